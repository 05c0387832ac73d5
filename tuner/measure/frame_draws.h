#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "tuner/measure/session.h"

namespace reliefbench {

// A whole frame as a session draws it. relief: a setting's textures and uniforms, without a pipeline.

/// The shaded frame of a setting, in the order of its draws: what hides it, the relief, objects beside it, the sky.
/// Only the relief's where the frame has no depth.
[[nodiscard]] std::vector<Draw> shaded_draws(Session& session, const Settings& settings, const Scene& scene,
                                             Draw relief);
/// The score frame of a setting, likewise.
[[nodiscard]] std::vector<Draw> scored_draws(Session& session, const Settings& settings, const Scene& scene,
                                             Draw relief);
/// The shaded frame of exact hits. relief: of reference_draw()
[[nodiscard]] std::vector<Draw> exact_draws(Session& session, std::span<const PixelFeature> features,
                                            const Scene& scene, Draw relief);

/// What people see of a setting whose shaded frame was drawn last: that, or the mean of those that its dithering goes
/// through. RGBA8
void read_picture(Session& session, const Settings& settings, const Scene& scene, Draw relief,
                  std::vector<std::uint8_t>& into);
/// Draws the shaded frame, and reads that.
void draw_picture(Session& session, const Settings& settings, const Scene& scene, const Draw& relief,
                  std::vector<std::uint8_t>& into);

}  // namespace reliefbench
