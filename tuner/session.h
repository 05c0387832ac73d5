#pragma once
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "backends/shader_compiler.h"
#include "backends/timer_audit.h"
#include "kernels/technique.h"
#include "tuner/wall_split.h"

namespace reliefbench {

/// The control case: known arithmetic, drawn between the samples, by which drift is seen and taken out.
struct Control {
  int load_steps = 0;       ///< LOAD_STEPS of load.frag
  int frames = 0;           ///< of one batch
  double reference_ns = 0;  ///< a frame's time when the run was first started; drift is measured against it
};

/// One open device of a sweep: its audited timer, its control case, and its compiled shaders, each compiled once.
class Session {
 public:
  /// Opens and audits. throws: Error(environment): no such device, no valid timer
  Session(const BackendRow& row, int device_index, WallSplit& split);

  [[nodiscard]] Backend& backend() { return *backend_; }
  [[nodiscard]] const DeviceInfo& device() const { return backend_->device(); }
  [[nodiscard]] const std::vector<TimerAudit>& audit() const { return audit_; }
  [[nodiscard]] Timer timer() const { return timer_; }

  struct Compiled {
    std::unique_ptr<Pipeline> pipeline;
    std::string spirv_sha256;
    double compile_ns = 0;
    double first_draw_ns = 0;  ///< compile and first draw; 0 until it is drawn
  };
  /// The pipeline of a technique for a target, from the run-time settings. source: the shader file's name.
  /// settings: may be null (the reference's shader has none). throws: Error(environment): compiler's words
  [[nodiscard]] Compiled& pipeline(std::string_view source, const Settings* settings, Target target, Wrap wrap);
  [[nodiscard]] int shaders_compiled() const { return static_cast<int>(pipelines_.size()); }

  /// Sets the control case up; `known`: that of an earlier start of the same run, or null to measure it now.
  void calibrate_control(double batch_ms, const Control* known);
  [[nodiscard]] const Control& control() const { return control_; }
  /// Time of one batch of the control case, ns.
  double draw_control_ns();
  /// Time of a batch by the session's timer, ns.
  double draw_ns(const Draw& draw, int frames);

 private:
  [[nodiscard]] const Spirv& fragment(std::string_view source, Target target);

  Dialect dialect_;
  WallSplit& split_;
  std::unique_ptr<Backend> backend_;  // outlives what it made
  std::vector<TimerAudit> audit_;
  Timer timer_ = Timer::fenced_wall;
  Spirv vertex_;
  std::map<std::string, Spirv, std::less<>> fragments_;
  std::map<std::string, Compiled, std::less<>> pipelines_;
  Control control_;
  std::unique_ptr<Pipeline> control_pipeline_;
  std::unique_ptr<Texture> blank_;
  Draw control_draw_;
};

}  // namespace reliefbench
