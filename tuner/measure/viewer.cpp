#include "tuner/measure/viewer.h"

#include <limits>
#include <utility>

#include "kernels/base/error.h"

namespace reliefbench {

Viewer::Viewer(const BackendRow& row, int device, SceneSpec scene, Heightmaps heightmaps)
    : scene_(std::move(scene)),
      session_(row, device, split_, false),
      library_(cache_, split_, std::move(heightmaps)),
      heights_(library_.heights(scene_)),
      tracer_(heights_, scene_.scene.wrap),
      preparer_({.session = session_,
                 .library = library_,
                 .cache = cache_,
                 .split = split_,
                 .folder = {},
                 .timeout_s = std::numeric_limits<double>::infinity(),
                 .flicker_frames = 0}) {}

void Viewer::choose(const Settings& settings) {
  if (const std::string reason = conflict(settings); !reason.empty()) fail_input("{}", reason);
  prepared_ = {};
  case_ = Case{.settings = settings, .scene_id = scene_.id, .backend = session_.device().backend};
  prepared_ = preparer_.prepare_to_time(*case_, scene_);
  if (prepared_.record.status != Status::ok) fail_environment("{}", prepared_.record.reason);
}

ViewedFrame Viewer::draw(const View& view) {
  scene_.scene.view = view;
  Backend& backend = session_.backend();
  Draw draw = prepared_.draw;
  draw.frame = frame_uniforms(scene_.scene, heights_.width, heights_.height);
  ViewedFrame frame;
  frame.wall_ns = backend.render(draw, 1, Timer::fenced_wall).wall_ns;
  frame.rgba8 = backend.read_color();
  const Settings& settings = case_->settings;
  draw.pipeline =
      session_.pipeline(settings.technique().id, &settings, Target::score, scene_.scene.wrap).pipeline.get();
  backend.render(draw, 1, Timer::fenced_wall);
  const std::vector<ScorePixel> pixels = backend.read_score();
  frame.judged = judge_frame(pixels, tracer_.trace(rays_of(pixels)), heights_.width, heights_.height);
  return frame;
}

}  // namespace reliefbench
