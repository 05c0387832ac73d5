#ifndef PACE_GLSL
#define PACE_GLSL
// How many steps a ray takes, as the parameter steps_by says. Not rounded: where neighbours' rays took whole steps, the
// picture would have seams.
float paced_steps(Ray ray) {
  float most = float(LINEAR_STEPS);
  float least = min(float(LEAST_STEPS), most);
  if (STEPS_BY == STEPS_BY_VIEW) return mix(most, least, ray.cosine);
  if (STEPS_BY == STEPS_BY_SLOPE) return mix(least, most, atan(length(ray.slope)) / HALF_PI);
  if (STEPS_BY == STEPS_BY_LENGTH)
    return clamp(length(ray.slope * vec2(level_size(ray.level))) / float(TEXELS_A_STEP), least, most);
  return most;
}
#endif
