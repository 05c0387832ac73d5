#include "tuner/measure/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>

#include "kernels/base/clock.h"
#include "kernels/base/error.h"
#include "kernels/base/parallel.h"
#include "kernels/base/sha256.h"
#include "kernels/base/size.h"
#include "kernels/trace/surface.h"
#include "tuner/measure/frame.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

constexpr int kControlSide_px = 256;
constexpr int kControlSteps = 256;
constexpr int kControlBatches = 15;
constexpr std::string_view kFull = "1080p";  // in a frame of that size every device has enough to do
constexpr int kFillBatches = 7;
constexpr double kLeastRenderPatience_s = 60;  // with a device that was lost in a frame, or that nothing is known of
constexpr double kRenderPatience = 10;         // times the limit

std::string shader_key(std::string_view shader, std::span<const PixelFeature> features, SurfaceKind surface,
                       const Target& target) {
  return fmt::format("{}{}{}{}/{}", shader, features.empty() ? "" : "?", text_of(features),
                     is_curved(surface) ? fmt::format(" on {}", surface_row(surface).id) : "",
                     is_score(target) ? "score" : "shade") +
         (target.by_compute ? " by compute" : "");
}

std::string pipeline_key(const std::string& fragment_key, std::span<const SpecConstant> constants) {
  std::string key = fragment_key;
  for (const SpecConstant& constant : constants) key += fmt::format(" {}={}", constant.id, constant.value);
  return key;
}

}  // namespace

std::unique_ptr<Backend> open_device(const BackendRow& row, int device_index) { return row.open(device_index, {}); }

Session::Session(const BackendRow& row, int device_index, WallSplit& split, bool is_timed, OpenDevice open)
    : row_(row),
      device_index_(device_index),
      open_(std::move(open)),
      dialect_(row.dialect),
      split_(split),
      backend_(opened()) {
  twice([&] {
    backend_->set_render_limit(kLeastRenderPatience_s);  // of the audits
    if (is_timed) audit_now();
    simulate_filter({});
  });
  backend_->set_render_limit(render_limit_s_);
}

std::unique_ptr<Backend> Session::opened() const {
  try {
    return open_(row_, device_index_);
  } catch (const Error& error) {
    if (!needs_reopening(error.fault())) throw;
    return open_(row_, device_index_);
  }
}

void Session::twice(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    if (!helps_reopening(error.fault())) throw;
    reopen();
    work();
  }
}

int batch_frames(double batch_ms, double frame_ns) {
  constexpr double kMost = 1e9;
  return static_cast<int>(std::clamp(std::ceil(batch_ms * 1e6 / std::max(frame_ns, 1.0)), 1.0, kMost));
}

void Session::audit_now() {
  split_.book(Part::audit, [&] { audit_ = audit_timers(*backend_, dialect_); });
}

void Session::audit_compute() {
  twice([&] {
    split_.book(Part::audit, [&] { audit_ = with_compute(audit_, audit_timers(*backend_, dialect_, true)); });
  });
}

void Session::simulate_filter(const SimulatedFilter& simulated) {
  simulated_ = simulated;
  pipelines_.clear();
  if (row_.real) split_.book(Part::audit, [&] { filter_audit_ = audit_filter(*backend_, dialect_, simulated); });
}

MapSampler Session::sampler_of(const Settings& settings) const {
  const auto found = std::ranges::find(filter_audit_, storage_of(settings).format.type, &FilterAudit::type);
  const bool is_known = found != filter_audit_.end() && found->refusal.empty();
  return {.error = is_known ? found->precision.error() : FilterError{}, .simulated = simulated_};
}

std::string Session::sampler_key(const Settings& settings) const {
  if (!makes_up_for_filter(settings)) return "";
  const FilterError error = sampler_of(settings).error;
  return fmt::format("{} {}", error.shift, error.value);
}

void Session::set_timeout(double timeout_s) {
  render_limit_s_ = std::max(timeout_s, kLeastRenderLimit_s);
  backend_->set_render_limit(render_limit_s_);
}

void Session::reopen() {
  const std::string name = device().name;
  control_draw_ = {};
  control_pipeline_ = nullptr;
  pipelines_.clear();
  backend_ = nullptr;  // a driver may refuse a second one beside what it lost
  try {
    backend_ = open_(row_, device_index_);
    // The frame that it was lost in may keep it busy for a while.
    backend_->set_render_limit(std::max(kRenderPatience * render_limit_s_, kLeastRenderPatience_s));
    if (calibration_.frames > 0) make_control();
    backend_->set_render_limit(render_limit_s_);
  } catch (const Error& error) {
    fail_environment("{}: {} was lost and does not work when it is opened again: {}", row_.id, name, error.what());
  }
}

const Spirv& Session::vertex(std::string_view name) {
  auto found = vertices_.find(name);
  if (found == vertices_.end()) found = vertices_.emplace(name, compile_vertex(dialect_, name)).first;
  return found->second;
}

Session::Stages Session::stages_of(const Source& source) {
  return {.vertex = &vertex(source.vertex), .fragment = &fragment(source)};
}

const Spirv& Session::fragment(const Source& source) {
  auto found = fragments_.find(source.fragment_key);
  if (found == fragments_.end())
    found =
        fragments_
            .emplace(source.fragment_key, source.is_beside ? compile_beside(source.shader, dialect_)
                                                           : compile_fragment(source.shader, source.target, dialect_,
                                                                              source.features, source.surface))
            .first;
  return found->second;
}

std::string Session::fragment_sha256(const Settings& settings, const Target& target, const Scene& scene) {
  return sha256(std::as_bytes(std::span(fragment(source_of(settings, target, scene)))));
}

Session::Source Session::source_of(const Settings& settings, const Target& target, const Scene& scene) const {
  Source source{.key = {},
                .fragment_key = {},
                .shader = settings.technique().id,
                .features = frame_features(settings),
                .surface = scene.surface.kind,
                .target = target,
                .constants = constants_of(&settings, scene.wrap, sampler_of(settings))};
  // The score frame of what is hidden is whole.
  if (is_score(target)) source.target = score_target(source.features, scene.surface.kind == SurfaceKind::mesh);
  source.target.by_compute = is_by_compute(settings);
  source.fragment_key = shader_key(source.shader, source.features, source.surface, source.target);
  set_vertex(source);
  return source;
}

void Session::set_vertex(Source& source) {
  // The plate of a curved surface is as far as anything may be: its depth is known to fragments alone.
  if (source.target.has_depth && !source.is_beside && !is_curved(source.surface)) source.vertex = "plate";
  if (surface_row(source.surface).has_mesh) source.vertex = "mesh";
  source.key = pipeline_key(source.fragment_key, source.constants);
  if (source.target.has_depth) source.key += fmt::format(" in {} with depth", source.vertex);
}

Session::Compiled Session::compile(const Source& source, const Stages& stages) const {
  const double start_ns = steady_ns();
  Compiled compiled;
  compiled.pipeline = backend_->compile({.label = std::string(source.shader),
                                         .vertex = *stages.vertex,
                                         .fragment = *stages.fragment,
                                         .constants = source.constants,
                                         .target = source.target});
  compiled.compile_ns = steady_ns() - start_ns;
  compiled.spirv_sha256 = sha256(std::as_bytes(std::span(*stages.fragment)));
  return compiled;
}

Session::Compiled& Session::pipeline(const Settings& settings, const Target& target, const Scene& scene) {
  return pipeline(source_of(settings, target, scene));
}

Session::Compiled& Session::reference_pipeline(std::span<const PixelFeature> features, const Scene& scene) {
  Source source{.key = {},
                .fragment_key = {},
                .shader = "reference",
                .features = exact_ones(features),
                .surface = scene.surface.kind,
                .target = color_target(features, needs_depth(scene)),
                .constants = constants_of(nullptr, scene.wrap)};
  source.fragment_key = shader_key(source.shader, source.features, source.surface, source.target);
  set_vertex(source);
  return pipeline(std::move(source));
}

Draw Session::beside(std::string_view shader, std::string_view vertex, float argument, const Draw& relief) {
  Source source{.key = {},
                .fragment_key = fmt::format("{}/beside", shader),
                .shader = shader,
                .vertex = vertex,
                .is_beside = true,
                .features = {},
                .surface = SurfaceKind::plane,
                .target = color_target({}, true),
                .constants = {}};
  set_vertex(source);
  Draw draw{.pipeline = pipeline(std::move(source)).pipeline.get(), .frame = relief.frame};
  draw.frame.argument() = argument;
  return draw;
}

std::vector<Draw> Session::with_what_is_beside(std::span<const PixelFeature> features, const Scene& scene,
                                               std::vector<Draw> relief) {
  if (!color_target(features, needs_depth(scene)).has_depth) return relief;
  const Draw any = relief.front();
  std::vector<Draw> frame;
  if (scene.occluded > 0)
    frame.emplace_back(beside("occluder", "occluder", static_cast<float>(scene.occluded), any)).vertices = 6;
  frame.insert(frame.end(), relief.begin(), relief.end());
  // In the numbers of objects.frag; the sky last, where nothing else is.
  const bool has_objects = color_target(features, false).has_depth;
  for (const int object : {0, 1, 2})
    if (has_objects || object == 2) frame.push_back(beside("objects", "fullscreen", static_cast<float>(object), any));
  return frame;
}

std::vector<Draw> Session::shaded(const Settings& settings, const Scene& scene, Draw relief) {
  const std::vector<PixelFeature> features = pixel_features(settings);
  const Target target = color_target(features, needs_depth(scene));
  relief.pipeline = pipeline(settings, target, scene).pipeline.get();
  return with_what_is_beside(features, scene, passes_of(settings, relief, target));
}

void Session::read_picture(const Settings& settings, const Scene& scene, Draw relief, std::vector<std::uint8_t>& into) {
  backend_->read_color(into);
  if (frames_seen(settings) == 1) return;
  PictureMean mean;
  mean.add(into);
  std::vector<std::uint8_t> picture;
  for (int i = 1; i < frames_seen(settings); ++i) {
    relief.frame.argument() = static_cast<float>(i);
    shade_frame(*backend_, shaded(settings, scene, relief), picture);
    mean.add(picture);
  }
  mean.put_colors(into);
}

void Session::draw_picture(const Settings& settings, const Scene& scene, const Draw& relief,
                           std::vector<std::uint8_t>& into) {
  backend_->render(shaded(settings, scene, relief), 1, Timer::fenced_wall);
  read_picture(settings, scene, relief, into);
}

std::vector<Draw> Session::scored(const Settings& settings, const Scene& scene, Draw relief) {
  relief.pipeline = pipeline(settings, Target::score, scene).pipeline.get();
  return passes_of(settings, relief, Target::score);
}

std::vector<Draw> Session::shaded_reference(std::span<const PixelFeature> features, const Scene& scene, Draw relief) {
  relief.pipeline = reference_pipeline(features, scene).pipeline.get();
  return with_what_is_beside(features, scene, {relief});
}

Session::Compiled& Session::pipeline(Source source) {
  auto found = pipelines_.find(source.key);
  if (found == pipelines_.end())
    split_.book(Part::compile, [&] {
      Compiled compiled = compile(source, stages_of(source));
      ++shaders_compiled_;
      found = pipelines_.emplace(std::move(source.key), std::move(compiled)).first;
    });
  found->second.last_use = ++uses_;
  return found->second;
}

void Session::drop_old_pipelines(std::size_t most) {
  if (pipelines_.size() <= most) return;
  if (most == 0) return pipelines_.clear();
  std::vector<std::int64_t> uses;
  uses.reserve(pipelines_.size());
  for (const auto& [key, compiled] : pipelines_) uses.push_back(compiled.last_use);
  const auto oldest_kept = uses.end() - static_cast<std::ptrdiff_t>(most);
  std::ranges::nth_element(uses, oldest_kept);
  std::erase_if(pipelines_, [&](const auto& one) { return one.second.last_use < *oldest_kept; });
}

void Session::compile_ahead(std::span<const Wanted> wanted) {
  if (!device().compiles_in_parallel) return;
  split_.book(Part::compile, [&] {
    std::map<std::string, Source> missing;
    for (const auto& [settings, target, scene] : wanted) {
      Source source = source_of(*settings, target, *scene);
      if (!pipelines_.contains(source.key)) missing.emplace(source.key, std::move(source));
    }
    std::vector<std::pair<const Source*, Stages>> sources;
    sources.reserve(missing.size());
    for (const auto& [key, source] : missing) sources.emplace_back(&source, stages_of(source));
    std::vector<Compiled> compiled(sources.size());
    parallel_for(static_cast<int>(sources.size()), 0, [&](int index) {
      const auto i = static_cast<std::size_t>(index);
      try {
        compiled[i] = compile(*sources[i].first, sources[i].second);
      } catch (const Error&) {  // it comes again, in the case that asks for it
      }
    });
    for (std::size_t i = 0; i < sources.size(); ++i) {
      if (!compiled[i].pipeline) continue;
      ++shaders_compiled_;
      pipelines_.emplace(sources[i].first->key, std::move(compiled[i]));
    }
  });
}

double Session::draw_ns(std::span<const Draw> frame, int frames) {
  const auto draw = [&] {
    const BatchTime time = backend_->render(frame, frames, calibration_.timer);
    return calibration_.timer == Timer::fenced_wall ? time.wall_ns : time.device_ns.value();
  };
  const auto is_time = [](double ns) { return std::isfinite(ns) && ns > 0; };
  double ns = draw();
  if (!is_time(ns)) ns = draw();
  if (!is_time(ns))
    fail_device(Fault::invalid_timer, "the timer {} says {} ns for {} frames", timer_id(calibration_.timer), ns,
                frames);
  return ns;
}

double Session::draw_pixel_ns(int width_px, int height_px) {
  const double pixels = 1.0 * width_px * height_px;
  constexpr double kControlPixels = 1.0 * kControlSide_px * kControlSide_px;
  // As much work as a batch of the control case.
  const int frames = std::max(1, static_cast<int>(std::lround(calibration_.frames * kControlPixels / pixels)));
  Draw draw = control_draw_;
  draw.frame.sizes = {width_px, height_px, 1, 1};
  return draw_ns(std::span(&draw, 1), frames) / frames / pixels;
}

void Session::measure_fills(std::span<const SceneSpec> scenes) {
  fills_.clear();
  if (device().software) return;
  std::set<Size> sizes;
  for (const SceneSpec& spec : scenes) sizes.insert({spec.scene.width_px, spec.scene.height_px});
  const FrameSize& full = *find_frame_size(kFull);
  for (const auto& [width_px, height_px] : sizes) {
    if (1.0 * width_px * height_px >= 1.0 * full.width_px * full.height_px) continue;
    for (const int scale : {1, 2}) draw_pixel_ns(scale * width_px, scale * height_px);  // makes the targets
    std::vector<double> own(kFillBatches);
    std::vector<double> larger(kFillBatches);
    for (std::size_t i = 0; i < own.size(); ++i) {
      own[i] = draw_pixel_ns(width_px, height_px);
      larger[i] = draw_pixel_ns(2 * width_px, 2 * height_px);
    }
    fills_.push_back({.width_px = width_px, .height_px = height_px, .pixel_cost = median(own) / median(larger)});
  }
}

double Session::draw_control_ns() { return draw_ns(std::span(&control_draw_, 1), calibration_.frames); }

void Session::make_control() {
  const Spirv load = compile_load(dialect_);
  control_pipeline_ = backend_->compile({.label = "load",
                                         .vertex = vertex("fullscreen"),
                                         .fragment = load,
                                         .constants = {{.id = 0, .value = calibration_.load_steps}},
                                         .target = Target::color});
  control_draw_ = {.pipeline = control_pipeline_.get()};
  control_draw_.frame.sizes = {kControlSide_px, kControlSide_px, 1, 1};
  draw_control_ns();  // the first draw compiles
}

void Session::calibrate(double batch_ms, const Calibration* known) {
  calibration_ =
      known != nullptr ? *known : Calibration{.timer = choose_timer(audit_), .load_steps = kControlSteps, .frames = 1};
  std::vector<double> frame_ns(kControlBatches);
  twice([&] {
    make_control();
    if (known != nullptr) return;
    calibration_.frames = batch_frames(batch_ms, draw_control_ns());
    for (double& value : frame_ns) value = draw_control_ns() / calibration_.frames;
  });
  if (known != nullptr) return;
  calibration_.state = state();
  calibration_.reference_ns = median(frame_ns);
}

}  // namespace reliefbench
