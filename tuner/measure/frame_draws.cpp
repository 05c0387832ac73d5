#include "tuner/measure/frame_draws.h"

#include <utility>

#include "tuner/measure/frame.h"

namespace reliefbench {
namespace {

Draw draw_beside(Session& session, std::string_view shader, std::string_view vertex, float argument,
                 const FrameUniforms& frame) {
  Draw draw{.pipeline = session.pipelines().get(beside_source(shader, vertex)).pipeline.get(), .frame = frame};
  draw.frame.argument() = argument;
  return draw;
}

std::vector<Draw> with_what_is_beside(Session& session, std::span<const PixelFeature> features, const Scene& scene,
                                      std::vector<Draw> relief) {
  if (!color_target(features, needs_depth(scene)).has_depth) return relief;
  const FrameUniforms& any = relief.front().frame;
  std::vector<Draw> frame;
  if (scene.occluded > 0)
    frame.emplace_back(draw_beside(session, "occluder", "occluder", static_cast<float>(scene.occluded), any)).vertices =
        6;
  frame.insert(frame.end(), relief.begin(), relief.end());
  // In the numbers of objects.frag; the sky last, where nothing else is.
  const bool has_objects = color_target(features, false).has_depth;
  for (const int object : {0, 1, 2})
    if (has_objects || object == 2)
      frame.push_back(draw_beside(session, "objects", "fullscreen", static_cast<float>(object), any));
  return frame;
}

}  // namespace

std::vector<Draw> shaded_draws(Session& session, const Settings& settings, const Scene& scene, Draw relief) {
  const Target target = shade_target(settings, scene);
  relief.pipeline = session.pipeline(settings, target, scene).pipeline.get();
  return with_what_is_beside(session, pixel_features(settings), scene, passes_of(settings, relief, target));
}

std::vector<Draw> scored_draws(Session& session, const Settings& settings, const Scene& scene, Draw relief) {
  relief.pipeline = session.pipeline(settings, Target::score, scene).pipeline.get();
  return passes_of(settings, relief, Target::score);
}

std::vector<Draw> exact_draws(Session& session, std::span<const PixelFeature> features, const Scene& scene,
                              Draw relief) {
  relief.pipeline = session.pipelines().get(exact_source(features, scene)).pipeline.get();
  return with_what_is_beside(session, features, scene, {relief});
}

void read_picture(Session& session, const Settings& settings, const Scene& scene, Draw relief,
                  std::vector<std::uint8_t>& into) {
  session.backend().read_color(into);
  if (frames_seen(settings) == 1) return;
  PictureMean mean;
  mean.add(into);
  std::vector<std::uint8_t> picture;
  for (int i = 1; i < frames_seen(settings); ++i) {
    relief.frame.argument() = static_cast<float>(i);
    shade_frame(session.backend(), shaded_draws(session, settings, scene, relief), picture);
    mean.add(picture);
  }
  mean.put_colors(into);
}

void draw_picture(Session& session, const Settings& settings, const Scene& scene, const Draw& relief,
                  std::vector<std::uint8_t>& into) {
  session.backend().render(shaded_draws(session, settings, scene, relief), 1, Timer::fenced_wall);
  read_picture(session, settings, scene, relief, into);
}

}  // namespace reliefbench
