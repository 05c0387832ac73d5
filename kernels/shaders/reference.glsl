// Not a technique: shades the exact hits that the CPU found, for the pictures that others are compared with.
#ifdef CURVED
Hit trace(Ray ray) {
  float t = texelFetch(reference_map, ivec2(gl_FragCoord.xy), 0).x;
  return Hit(t, t < 1e30 ? STATUS_HIT : STATUS_PASSED, 1, 0);
}
#else
Hit trace(Ray ray) { return Hit(texelFetch(reference_map, ivec2(gl_FragCoord.xy), 0).x, STATUS_HIT, 1, 0); }
#endif
