#include "tuner/measure/judged.h"

#include "tuner/measure/frame_draws.h"

namespace reliefbench {

JudgedFrame judged_by_exact(Session& session, const Settings& settings, const Scene& scene, const Draw& relief,
                            const UploadedScene& uploaded, const ReferenceTracer& tracer) {
  Backend& backend = session.backend();
  const std::vector<ScorePixel> pixels = trace_frame(backend, scored_draws(session, settings, scene, relief));
  const std::vector<ReferenceHit> exact = exact_hits(tracer, relief.frame, uploaded.wrap, pixels, uploaded.mesh.get());
  JudgedFrame judged = judge(relief.frame, uploaded.wrap, uploaded.is_solid, pixels, exact);
  const std::vector<PixelFeature> features = pixel_features(settings);
  judge_features(features, backend.read_values(features),
                 exact_values(features, tracer, relief.frame, rays_of(pixels), exact), judged.pixels, judged.score);
  return judged;
}

}  // namespace reliefbench
