#pragma once
#include "kernels/judge/score.h"
#include "kernels/trace/surface_tracer.h"
#include "tuner/measure/frame.h"
#include "tuner/measure/session.h"

namespace reliefbench {

/// Traces a setting's score frame, and judges it by exact hits, and by the exact values of its features.
/// relief: its textures and uniforms; uploaded: the scene; tracer: of its heights
[[nodiscard]] JudgedFrame judged_by_exact(Session& session, const Settings& settings, const Scene& scene,
                                          const Draw& relief, const UploadedScene& uploaded,
                                          const ReferenceTracer& tracer);

}  // namespace reliefbench
