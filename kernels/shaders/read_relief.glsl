#ifndef READ_RELIEF_GLSL
#define READ_RELIEF_GLSL
// What a map keeps of the empty space over a point.
struct Relief {
  float height;
  float ratio;   // of the cone
  float radius;  // uv, whatever the height; 0 without a cylinder
  float behind;  // as ratio, for rays the other way
};

// What the sampler's results may be off by, beside its weights.
float sampler_error() { return float(SAMPLER_ERROR) * SAMPLER_UNIT; }

// The surface as high and the cone as narrow as they may be then.
Relief cautious(float height, float stored) {
  float narrowest = ENCODING == ENCODING_ATAN ? min(stored + sampler_error(), 1.0) : max(stored - sampler_error(), 0.0);
  float ratio = decoded_ratio(narrowest, height - sampler_error());
  return Relief(height + sampler_error(), ratio, 0.0, ratio);
}

Relief decoded_relief(float height, float stored) {
  if (SAMPLER_ERROR != SAMPLER_ERROR_NONE) return cautious(height, stored);
  float ratio = decoded_ratio(stored, height);
  return Relief(height, ratio, 0.0, ratio);
}
#endif
