#include "reports/viewer/live_pictures.h"

#include <algorithm>
#include <utility>

#include "kernels/base/error.h"
#include "kernels/trace/mesh_frame.h"
#include "kernels/trace/surface_tracer.h"
#include "reports/viewer/overlay.h"
#include "tuner/measure/frame_draws.h"

namespace reliefbench {
namespace {

OpenDevice opener_of(const Window& window, bool debug) {
  return [&window, debug](const BackendRow& row, int device) { return open_in(window, row, device, {.debug = debug}); };
}

/// What the background made for a pane.
struct MadeMap {
  std::optional<MapTextures> map;
  std::vector<std::uint8_t> normals;
};

std::vector<float> taps_of(const std::vector<ScorePixel>& pixels) {
  std::vector<float> taps;
  taps.reserve(pixels.size());
  for (const ScorePixel& pixel : pixels)
    taps.push_back(pixel.status == static_cast<float>(PixelStatus::no_ray) ? -1.0F : pixel.taps);
  return taps;
}

/// wanted: picture_key() of what is not to be had
void fail(Pane& pane, const std::string& wanted, const Error& error) {
  pane.failure = error.what();
  pane.failed_key = wanted;
}

std::string overlay_key(const Pane& pane, Overlay overlay) {
  return std::string(kOverlays.at(static_cast<std::size_t>(overlay)).id) + " " + pane.judged_key;
}

}  // namespace

LivePictures::LivePictures(const Window& window, LivePicturesOptions options)
    : session_(*options.row, options.device, split_,
               {.audits = Audits::none, .open = opener_of(window, options.debug)}),
      screen_(make_screen(window, session_.backend())),
      library_(cache_, background_split_, std::move(options.heightmaps)),
      heights_(library_.loaded(options.spec)),
      tracer_(heights_.field, options.spec.scene.wrap),
      mesh_(options.spec.scene.surface.kind == SurfaceKind::mesh
                ? std::make_unique<const Mesh>(load_mesh(options.spec.scene.surface))
                : nullptr),
      left_(*screen_, options.spec.scene.width_px, options.spec.scene.height_px),
      right_(*screen_, options.spec.scene.width_px, options.spec.scene.height_px),
      reference_(screen_->make_picture(options.spec.scene.width_px, options.spec.scene.height_px)) {}

const TimerAudit& LivePictures::audit() const {
  return *std::ranges::find(session_.audit(), timer_, &TimerAudit::timer);
}

void LivePictures::audit_timers() {
  if (session_.audit().empty()) session_.audit_timers();
  if (std::exchange(is_compute_audited_, shows_compute() || is_compute_audited_) != is_compute_audited_)
    session_.audit_compute_timers();
  const bool has_valid = std::ranges::any_of(session_.audit(), &TimerAudit::valid);
  timer_ = has_valid ? choose_timer(session_.audit()) : Timer::fenced_wall;
  times_ns_.clear();  // they may be another timer's
  static_cast<void>(time_again(1));
}

void LivePictures::update(const ViewChoice& choice) {
  background_.finish();
  bring(left_, choice.settings, choice.spec);
  if (choice.other)
    bring(right_, *choice.other, choice.spec);
  else
    right_.compiles_next = false;
  const bool is_moving = std::exchange(last_key_, left_.picture_key) != left_.picture_key;
  if (!is_moving || Clock::now() >= judge_after_) judge_next(choice);
  lay_over(left_, choice.overlay);
  if (choice.other) lay_over(right_, choice.overlay);
}

void LivePictures::judge_next(const ViewChoice& choice) {
  const bool needs_reference = !choice.other && !is_reference_current();
  if (!background_.is_busy() && left_.is_drawn() && (!left_.is_judged() || needs_reference))
    judge_in_background(left_, choice.spec);
  if (!background_.is_busy() && choice.other && right_.is_drawn() && !right_.is_judged())
    judge_in_background(right_, choice.spec);
}

bool LivePictures::is_settled(const ViewChoice& choice) const {
  if (background_.is_busy() || !is_audited()) return false;
  const auto is_there = [&](const Pane& pane, const Settings& settings) {
    if (!pane.failure.empty()) return true;
    if (pane.picture_key != picture_key(settings, choice.spec) || !pane.is_judged()) return false;
    return choice.overlay == Overlay::none || pane.overlay_key == overlay_key(pane, choice.overlay);
  };
  if (!is_there(left_, choice.settings)) return false;
  return choice.other ? is_there(right_, *choice.other) : !left_.failure.empty() || is_reference_current();
}

void LivePictures::bring(Pane& pane, const Settings& settings, const SceneSpec& spec) {
  const std::string wanted = picture_key(settings, spec);
  if (pane.failed_key == wanted) return;
  pane.failed_key.clear();
  const bool was_told = std::exchange(pane.compiles_next, false);
  pane.failure = conflict(settings, spec.scene, heights().field.is_solid());
  if (!pane.failure.empty() || pane.picture_key == wanted) return;
  if (std::string key = map_key(settings, spec); pane.map_key != key) {
    if (!background_.is_busy()) fetch_map(pane, settings, spec, std::move(key));
    return;
  }
  if (!was_told &&
      !session_.pipelines().has(session_.source_of(settings, shade_target(settings, spec.scene), spec.scene))) {
    pane.compiles_next = true;
    return;
  }
  try {
    draw(pane, settings, spec);
  } catch (const Error& error) {
    if (needs_reopening(error.fault())) throw;
    fail(pane, wanted, error);
  }
}

void LivePictures::fetch_map(Pane& pane, const Settings& settings, const SceneSpec& spec, std::string key) {
  background_.start([this, &pane, settings, spec, key = std::move(key)]() -> Background::Finish {
    try {
      auto made = std::make_shared<MadeMap>();
      made->map = library_.packed(settings, spec);
      made->normals = normal_map(heights_.field, spec.scene.wrap, spec.scene.relief_depth);
      return [this, &pane, spec, key, made] {
        pane.frame = {};
        pane.uploaded = {.normals = session_.backend().upload({.width = heights_.field.width,
                                                               .height = heights_.field.height,
                                                               .texels = std::as_bytes(std::span(made->normals)),
                                                               .wrap = spec.scene.wrap}),
                         .uploaded_mesh = mesh_ ? upload(session_.backend(), *mesh_) : UploadedMesh{},
                         .wrap = spec.scene.wrap};
        pane.frame = upload(session_.backend(), made->map, pane.uploaded);
        pane.settings.reset();
        pane.map_key = key;
      };
    } catch (const Error& error) {
      return [&pane, error, wanted = picture_key(settings, spec)] { fail(pane, wanted, error); };
    }
  });
}

void LivePictures::draw(Pane& pane, const Settings& settings, const SceneSpec& spec) {
  Backend& backend = session_.backend();
  pane.frame.draw.frame = frame_uniforms(spec.scene, heights_.field.width, heights_.field.height);
  const std::vector<Draw> shade = shaded_draws(session_, settings, spec.scene, pane.frame.draw);
  if (!pane.settings || !(*pane.settings == settings)) backend.render(shade, 1, Timer::fenced_wall);  // it compiles
  pane.settings = settings;
  pane.scene = spec.scene;
  const BatchTime time = backend.render(shade, 1, timer_);
  screen_->keep(*pane.picture);
  pane.picture_key = picture_key(settings, spec);
  if (&pane == &left_) keep_time(time.device_ns.value_or(time.wall_ns));
}

std::vector<double> LivePictures::time_again(int frames) {
  std::vector<double> times_ns;
  if (!left_.settings) return times_ns;
  const std::vector<Draw> shade = shaded_draws(session_, *left_.settings, left_.scene, left_.frame.draw);
  for (int i = 0; i < frames; ++i) {
    const BatchTime time = session_.backend().render(shade, 1, timer_);
    times_ns.push_back(time.device_ns.value_or(time.wall_ns));
    keep_time(times_ns.back());
  }
  return times_ns;
}

void LivePictures::keep_time(double ns) {
  times_ns_.push_back(ns);
  if (times_ns_.size() > kMostTimes) times_ns_.erase(times_ns_.begin());
}

void LivePictures::judge_in_background(Pane& pane, const SceneSpec& spec) {
  const Clock::time_point start = Clock::now();
  const Settings& settings = *pane.settings;
  const std::vector<Draw> score = scored_draws(session_, settings, spec.scene, pane.frame.draw);
  std::vector<PixelFeature> features = pixel_features(settings);
  std::vector<ScorePixel> pixels = trace_frame(session_.backend(), score);
  FeatureValues values = session_.backend().read_values(features);
  background_.start([this, &pane, start, key = pane.picture_key, frame = pane.frame.draw.frame, wrap = spec.scene.wrap,
                     features = std::move(features), pixels = std::move(pixels),
                     values = std::move(values)]() -> Background::Finish {
    auto exact = std::make_shared<std::vector<ReferenceHit>>(exact_hits(tracer_, frame, wrap, pixels, mesh_.get()));
    auto judged = std::make_shared<JudgedFrame>(judge(frame, wrap, heights().field.is_solid(), pixels, *exact));
    FeatureValues right = exact_values(features, tracer_, frame, rays_of(pixels), *exact);
    judge_features(features, values, right, judged->pixels, judged->score);
    if (mesh_) right = places_on_mesh(MeshFrame(tracer_, *mesh_, frame), frame, *exact);
    return [this, &pane, start, key, frame, features, exact, judged, right, taps = taps_of(pixels)] {
      judge_after_ = Clock::now() + (Clock::now() - start);  // half of the time is the pictures'
      pane.judged_key = key;
      pane.score = judged->score;
      pane.scores = std::move(judged->pixels);
      pane.taps = taps;
      if (&pane != &left_) return;
      draw_reference(*exact, features, right, frame);
      reference_key_ = key;
    };
  });
}

void LivePictures::draw_reference(const std::vector<ReferenceHit>& hits, const std::vector<PixelFeature>& features,
                                  const FeatureValues& values, const FrameUniforms& frame) {
  const std::unique_ptr<Texture> exact = upload_exact(session_.backend(), hits, values, frame);
  const Draw relief = reference_draw(left_.uploaded, *exact, frame);
  session_.backend().render(exact_draws(session_, features, left_.scene, relief), 1, Timer::fenced_wall);
  screen_->keep(*reference_);
}

void LivePictures::lay_over(Pane& pane, Overlay overlay) {
  if (overlay == Overlay::none || pane.judged_key.empty()) return;
  const std::string key = overlay_key(pane, overlay);
  if (pane.overlay_key == key) return;
  screen_->fill(*pane.overlay, overlay_picture(overlay, {.scores = pane.scores,
                                                         .taps = pane.taps,
                                                         .width_px = pane.picture->width_px,
                                                         .height_px = pane.picture->height_px}));
  pane.overlay_key = key;
}

}  // namespace reliefbench
