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

}  // namespace

std::unique_ptr<Backend> open_device(const BackendRow& row, int device_index) { return row.open(device_index, {}); }

Session::Session(const BackendRow& row, int device_index, WallSplit& split, SessionOptions options)
    : row_(row),
      device_index_(device_index),
      open_(std::move(options.open)),
      dialect_(row.dialect),
      split_(split),
      render_limit_s_(std::max(options.timeout_s, kLeastRenderLimit_s)),
      backend_(opened()),
      pipelines_(row.dialect, split) {
  pipelines_.set_backend(*backend_);
  twice([&] {
    backend_->set_render_limit(kLeastRenderPatience_s);  // of the audits
    if (options.audits != Audits::none) audit_timers();
    if (options.audits == Audits::of_dispatches ||
        (options.audits == Audits::of_hardware_dispatches && !device().software))
      audit_compute_timers();
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

void Session::audit_timers() {
  split_.book(Part::audit, [&] { audit_ = reliefbench::audit_timers(*backend_, dialect_); });
}

void Session::audit_compute_timers() {
  split_.book(Part::audit,
              [&] { audit_ = with_compute(audit_, reliefbench::audit_timers(*backend_, dialect_, true)); });
}

void Session::simulate_filter(const SimulatedFilter& simulated) {
  simulated_ = simulated;
  pipelines_.drop_all();
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

void Session::reopen() {
  const std::string name = device().name;
  control_draw_ = {};
  control_pipeline_ = nullptr;
  pipelines_.drop_all();
  backend_ = nullptr;  // a driver may refuse a second one beside what it lost
  try {
    backend_ = open_(row_, device_index_);
    pipelines_.set_backend(*backend_);
    // The frame that it was lost in may keep it busy for a while.
    backend_->set_render_limit(std::max(kRenderPatience * render_limit_s_, kLeastRenderPatience_s));
    if (calibration_.frames > 0) make_control();
    backend_->set_render_limit(render_limit_s_);
  } catch (const Error& error) {
    throw DeviceGone(
        fmt::format("{}: {} was lost and does not work when it is opened again: {}", row_.id, name, error.what()));
  }
}

PipelineSource Session::source_of(const Settings& settings, const Target& target, const Scene& scene) const {
  return relief_source(settings, target, scene, sampler_of(settings));
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
                                         .vertex = pipelines_.vertex("fullscreen"),
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
