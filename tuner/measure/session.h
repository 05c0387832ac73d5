#pragma once
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "backends/filter_audit.h"
#include "backends/timer_audit.h"
#include "kernels/trace/technique.h"
#include "kernels/trace/view.h"
#include "tuner/measure/pipelines.h"
#include "tuner/measure/wall_split.h"
#include "tuner/plan/case.h"
#include "tuner/results/frame_fill.h"
#include "tuner/results/record.h"

namespace reliefbench {

/// What a run's times rest on, settled when it is first started and kept when it is continued: the timer, and the
/// control case (known arithmetic, drawn between the samples, by which drift is seen and taken out).
struct Calibration {
  Timer timer = Timer::fenced_wall;
  int load_steps = 0;       ///< LOAD_STEPS of load.glsl
  int frames = 0;           ///< of one batch of the control case
  double reference_ns = 0;  ///< a frame's time of the control case when the run was first started
  DeviceState state{};      ///< right after that
};

/// Opens a device of a row; throws as that does. Tests put devices in between that fail, commands open_isolated().
using OpenDevice = std::function<std::unique_ptr<Backend>(const BackendRow&, int device_index)>;
/// In this process.
[[nodiscard]] std::unique_ptr<Backend> open_device(const BackendRow& row, int device_index);

/// How many frames of a length make a batch of that length at least.
[[nodiscard]] int batch_frames(double batch_ms, double frame_ns);

/// Which timers a session audits when it is opened.
enum class Audits {
  none,  ///< nothing is going to be timed, or audit_timers() comes later
  of_frames,
  of_dispatches,           ///< by work of compute shaders, too
  of_hardware_dispatches,  ///< likewise, but those of software rasterisers of_frames
};

[[nodiscard]] inline Audits audits_for(bool has_compute) {
  return has_compute ? Audits::of_dispatches : Audits::of_frames;
}

struct SessionOptions {
  Audits audits = Audits::of_frames;
  OpenDevice open = open_device;
  /// A batch that does not end in that time ends its case (Backend::set_render_limit), though no limit is under a
  /// second: a busy machine takes that long for anything.
  double timeout_s = std::numeric_limits<double>::infinity();
};

/// One open device of a sweep: its audited timers and filter, its calibration, and its pipelines.
class Session {
 public:
  /// Opens, and audits the filter and the timers.
  /// throws: Error(environment): no such device, or lost twice over its audits
  Session(const BackendRow& row, int device_index, WallSplit& split, SessionOptions options = {});

  /// What the constructor left of the audits. throws: Error: the device's, which stays as it is
  void audit_timers();
  /// Once more by work of compute shaders, which a timer may see otherwise: those that fail are not valid.
  void audit_compute_timers();

  /// Opens the device again after it was lost, and draws the control case on it. Whatever was made on the lost one must
  /// be gone before; pipelines are compiled anew when they are asked for. Calibration and audit stay.
  /// throws: DeviceGone: it cannot be opened, or does not draw; nothing but destruction is left for the session then
  void reopen();

  /// Whether the device is to be opened again before anything else is drawn.
  [[nodiscard]] bool is_lost(Status status) const { return status == Status::device_lost || backend_->is_gone(); }
  [[nodiscard]] bool is_lost(Fault fault) const { return needs_reopening(fault) || backend_->is_gone(); }
  /// Whether what no case is to blame for may go well once the device is opened anew.
  [[nodiscard]] bool helps_reopening(Fault fault) const { return is_lost(fault) || fault == Fault::out_of_memory; }

  [[nodiscard]] Backend& backend() { return *backend_; }
  [[nodiscard]] const DeviceInfo& device() const { return backend_->device(); }
  [[nodiscard]] const std::vector<TimerAudit>& audit() const { return audit_; }
  /// None where the device is not real.
  [[nodiscard]] const std::vector<FilterAudit>& filter_audit() const { return filter_audit_; }

  /// From now on shaders compute what such a sampler reads, which is audited in the device's place.
  void simulate_filter(const SimulatedFilter& simulated);
  /// How these settings' map is read: what the audit found of its type of texel.
  [[nodiscard]] MapSampler sampler_of(const Settings& settings) const;
  /// What of that their frames depend on: part of keys.
  [[nodiscard]] std::string sampler_key(const Settings& settings) const;

  [[nodiscard]] Pipelines& pipelines() { return pipelines_; }
  [[nodiscard]] const Pipelines& pipelines() const { return pipelines_; }
  /// Of a setting's relief, with its sampler.
  [[nodiscard]] PipelineSource source_of(const Settings& settings, const Target& target, const Scene& scene) const;
  [[nodiscard]] Compiled& pipeline(const Settings& settings, const Target& target, const Scene& scene) {
    return pipelines_.get(source_of(settings, target, scene));
  }

  /// `known`: the calibration of an earlier start of the same run, or null to settle one now.
  /// throws: Error(environment): no valid timer
  void calibrate(double batch_ms, const Calibration* known);
  [[nodiscard]] const Calibration& calibration() const { return calibration_; }
  /// Not to be asked for inside a batch.
  [[nodiscard]] DeviceState state() { return backend_->state(); }
  /// Time of one batch of the control case, ns.
  double draw_control_ns();
  /// How well frames of these scenes' sizes fill the device. Nothing of a software rasteriser, which any frame does,
  /// nor of frames that are as large as a screen.
  void measure_fills(std::span<const SceneSpec> scenes);
  [[nodiscard]] const std::vector<FrameFill>& fills() const { return fills_; }
  /// Time of a batch by the calibration's timer, ns. One that is no time, as clocks that are read at odds with each
  /// other may make it, is drawn once more.
  /// throws: Error of Fault::invalid_timer: it is not finite and above zero, twice
  double draw_ns(std::span<const Draw> frame, int frames);

 private:
  /// Does what no case is to blame for; where helps_reopening(), once more on the device opened anew.
  void twice(const std::function<void()>& work);
  /// A driver that crashes over it is asked once more.
  [[nodiscard]] std::unique_ptr<Backend> opened() const;
  void make_control();
  /// Time of a pixel of the control case in frames of a size, ns.
  double draw_pixel_ns(int width_px, int height_px);

  const BackendRow& row_;
  int device_index_;
  OpenDevice open_;
  Dialect dialect_;
  WallSplit& split_;
  double render_limit_s_;
  std::unique_ptr<Backend> backend_;  // outlives what it made
  std::vector<TimerAudit> audit_;
  SimulatedFilter simulated_;
  std::vector<FilterAudit> filter_audit_;
  Pipelines pipelines_;
  Calibration calibration_;
  std::vector<FrameFill> fills_;
  std::unique_ptr<Pipeline> control_pipeline_;
  Draw control_draw_;
};

}  // namespace reliefbench
