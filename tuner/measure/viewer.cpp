#include "tuner/measure/viewer.h"

#include <utility>

#include "kernels/base/error.h"
#include "tuner/measure/frame_draws.h"
#include "tuner/measure/judged.h"

namespace reliefbench {

Viewer::Viewer(const BackendRow& row, int device, SceneSpec scene, Heightmaps heightmaps, OpenDevice open)
    : scene_(std::move(scene)),
      session_(row, device, split_,
               {.audits = Audits::none, .open = std::move(open), .timeout_s = MeasureSpec{}.timeout_s}),
      library_(cache_, split_, std::move(heightmaps)),
      heights_(library_.heights(scene_)),
      tracer_(heights_, scene_.scene.wrap) {
  uploaded_ = upload(session_.backend(), scene_.scene, heights_);
}

void Viewer::choose(const Settings& settings) {
  if (const std::string reason = conflict(settings, scene_.scene, heights_.is_solid()); !reason.empty())
    fail_input("{}", reason);
  frame_ = {};
  settings_ = settings;
  frame_ = upload(session_.backend(), library_.packed(settings, scene_), uploaded_);
  static_cast<void>(shade_frame(
      session_.backend(), shaded_draws(session_, settings, scene_.scene, frame_.draw)));  // the first draw compiles
}

ViewedFrame Viewer::draw(const View& view) {
  scene_.scene.view = view;
  frame_.draw.frame = frame_uniforms(scene_.scene, heights_.width, heights_.height);
  Backend& backend = session_.backend();
  const std::vector<Draw> shade = shaded_draws(session_, *settings_, scene_.scene, frame_.draw);
  ViewedFrame frame;
  frame.wall_ns = backend.render(shade, 1, Timer::fenced_wall).wall_ns;
  read_picture(session_, *settings_, scene_.scene, frame_.draw, frame.rgba8);
  frame.judged = judged_by_exact(session_, *settings_, scene_.scene, frame_.draw, uploaded_, tracer_);
  return frame;
}

}  // namespace reliefbench
