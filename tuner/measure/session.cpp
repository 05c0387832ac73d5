#include "tuner/measure/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

#include "kernels/base/sha256.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

constexpr int kControlSide_px = 256;
constexpr int kControlSteps = 256;
constexpr int kControlBatches = 15;

std::string shader_key(std::string_view source, Target target) {
  return fmt::format("{}/{}", source, target == Target::color ? "shade" : "score");
}

double now_ns() {
  return std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

std::vector<SpecConstant> constants_of(const Settings* settings, Wrap wrap) {
  std::vector<SpecConstant> constants = {{.id = kWrapConstant, .value = wrap == Wrap::clamp ? 1 : 0}};
  if (settings == nullptr) return constants;
  for (const Param& param : settings->technique().params)
    if (param.constant_id >= 0)
      constants.push_back({.id = static_cast<std::uint32_t>(param.constant_id), .value = settings->get(param.id)});
  if (settings->technique().reads_map()) {
    const MapStorage storage = storage_of(*settings);
    const Format& format = storage.format;
    constants.push_back({.id = kConeFetchConstant, .value = storage.correction == Correction::min4 ? 1 : 0});
    constants.push_back({.id = kLayoutConstant, .value = format.with_normal ? 2 : (format.extra_channels > 0 ? 1 : 0)});
  }
  return constants;
}

Session::Session(const BackendRow& row, int device_index, WallSplit& split, bool is_timed)
    : dialect_(row.dialect), split_(split), backend_(row.open(device_index, {})) {
  if (is_timed) split_.book(Part::audit, [&] { audit_ = audit_timers(*backend_, dialect_); });
  vertex_ = compile_vertex(dialect_);
}

const Spirv& Session::fragment(std::string_view source, Target target) {
  const std::string key = shader_key(source, target);
  auto found = fragments_.find(key);
  if (found == fragments_.end()) found = fragments_.emplace(key, compile_fragment(source, target, dialect_)).first;
  return found->second;
}

std::string Session::fragment_sha256(std::string_view source, Target target) {
  return sha256(std::as_bytes(std::span(fragment(source, target))));
}

Session::Compiled& Session::pipeline(std::string_view source, const Settings* settings, Target target, Wrap wrap) {
  const std::vector<SpecConstant> constants = constants_of(settings, wrap);
  std::string key = shader_key(source, target);
  for (const SpecConstant& constant : constants) key += fmt::format(" {}={}", constant.id, constant.value);
  if (const auto found = pipelines_.find(key); found != pipelines_.end()) return found->second;

  return split_.book(Part::compile, [&]() -> Compiled& {
    const double start_ns = now_ns();
    const Spirv& spirv = fragment(source, target);
    Compiled compiled;
    compiled.pipeline = backend_->compile(
        {.label = std::string(source), .vertex = vertex_, .fragment = spirv, .constants = constants, .target = target});
    compiled.compile_ns = now_ns() - start_ns;
    compiled.spirv_sha256 = sha256(std::as_bytes(std::span(spirv)));
    return pipelines_.emplace(std::move(key), std::move(compiled)).first->second;
  });
}

double Session::draw_ns(const Draw& draw, int frames) {
  const BatchTime time = backend_->render(draw, frames, calibration_.timer);
  return calibration_.timer == Timer::fenced_wall ? time.wall_ns : time.device_ns.value();
}

double Session::draw_control_ns() { return draw_ns(control_draw_, calibration_.frames); }

void Session::calibrate(double batch_ms, const Calibration* known) {
  calibration_ =
      known != nullptr ? *known : Calibration{.timer = choose_timer(audit_), .load_steps = kControlSteps, .frames = 1};
  const Spirv load = compile_load(dialect_);
  control_pipeline_ = backend_->compile({.label = "load",
                                         .vertex = vertex_,
                                         .fragment = load,
                                         .constants = {{.id = 0, .value = calibration_.load_steps}},
                                         .target = Target::color});
  constexpr std::array<std::byte, 4> kBlack{};
  blank_ = backend_->upload({.width = 1, .height = 1, .texels = kBlack});
  control_draw_ = {.pipeline = control_pipeline_.get(),
                   .relief = blank_.get(),
                   .normals = blank_.get(),
                   .reference = blank_.get(),
                   .extra = blank_.get()};
  control_draw_.frame.sizes = {kControlSide_px, kControlSide_px, 1, 1};
  draw_control_ns();  // the first draw compiles
  if (known != nullptr) return;
  const double frame_ms = draw_control_ns() * 1e-6;
  calibration_.frames = std::max(1, static_cast<int>(std::ceil(batch_ms / frame_ms)));
  std::vector<double> frame_ns(kControlBatches);
  for (double& value : frame_ns) value = draw_control_ns() / calibration_.frames;
  calibration_.reference_ns = median(frame_ns);
}

}  // namespace reliefbench
