#ifndef DITHER_GLSL
#define DITHER_GLSL
// Where in its first step a ray begins.

// A share of a step, 0 to 1: another for each pixel, and the eight that a pixel has in eight frames are evenly apart.
// The R2 sequence (Roberts 2018) in whole numbers: the same bits on every device.
float relief_dither(ivec2 pixel, int number) {
  uint frames_apart = 0xffffffffu / uint(DITHER_FRAMES) + 1u;
  uint share = uint(pixel.x) * 3242174889u + uint(pixel.y) * 2447445414u + uint(number) * frames_apart;
  return float(share >> 8) / 16777216.0;
}

// How long the first step is, in steps: over 0, at most 1.
float first_step() {
  if (DITHER == DITHER_NONE) return 1.0;
  return 1.0 - dither_phase;
}
#endif
