// Relief mapping: linear search, then refinement. [RTM] listing 5.3
#include "dither.glsl"
#include "linear_search.glsl"
#include "pace.glsl"
#include "refinement.glsl"

Hit trace(Ray ray) {
  Bracket bracket;
  Hit hit;
  if (linear_search(ray, paced_steps(ray), first_step(), bracket, hit)) refine(ray, bracket, hit);
  return hit;
}
