// Relief mapping by depth slices: planes of equal distance, of which the highest that is at or under the surface at its
// own point of the ray wins. [RTM] listing 5.2 draws them as passes, bottom first, and later ones overwrite.
#include "refine.glsl"

Hit trace(Ray ray) {
  Hit hit = Hit(RAY_END(ray), STATUS_HIT, 0, 0);
  for (int i = 1; i <= SLICES; ++i) {
    // Leaving early wants the top plane first. The bottom one (t = 1) is under every relief.
    int slice = LOOP == LOOP_EARLY_EXIT ? i : SLICES + 1 - i;
    float t = float(slice) / float(SLICES);
    IF_BENT(t *= ray.end;)
    hit.steps += 1;
    if (gap_at(ray, t, hit) <= 0.0) {
      hit.t = t;
      if (LOOP == LOOP_EARLY_EXIT) break;
    }
  }
  return hit;
}
