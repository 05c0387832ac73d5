// The normal map at the found uv with its own derivatives, less whole tiles where a neighbour lies in another one.
vec4 normal_texel(vec2 uv, Pixel pixel) {
  vec2 across = dFdx(uv);
  vec2 down = dFdy(uv);
  return textureGrad(normal_map, uv, across - round(across), down - round(down));
}
