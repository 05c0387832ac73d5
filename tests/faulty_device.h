#pragma once
#include <array>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <utility>

#include "kernels/base/error.h"
#include "tests/forwarding_backend.h"
#include "tuner/measure/session.h"

namespace reliefbench {

/// Opens devices that fail at chosen calls, counted over all that it opened. A lost one fails whatever is asked of it.
/// They may be said to be hardware.
class FaultyDevices {
 public:
  enum Call { upload, compile, draw, open, compute };

  void fail(Call call, int nth, Fault fault) { faults_[{call, nth}] = fault; }  ///< nth: from 0
  void slow_down(int from_draw, double factor, int to_draw = 1 << 30) {
    slow_from_ = from_draw;
    slow_to_ = to_draw;
    factor_ = factor;
  }
  /// What the devices say of themselves when they are asked for the n-th time, from 0.
  void tell(std::function<DeviceState(int)> state_of) { state_of_ = std::move(state_of); }
  void be_hardware() { is_hardware_ = true; }
  /// The times of the n-th compute job, from 0. Their clock then agrees with the host's, whatever else the machine
  /// does.
  void tell_times(std::function<std::vector<ComputeTime>(int)> times_of) { times_of_ = std::move(times_of); }
  [[nodiscard]] int states_told() const { return states_told_; }
  [[nodiscard]] bool had_compute_audit() const { return had_compute_audit_; }
  [[nodiscard]] int calls(Call call) const { return calls_.at(call); }
  [[nodiscard]] OpenDevice opener() {
    return [this](const BackendRow& row, int index) -> std::unique_ptr<Backend> {
      count(open);
      return std::make_unique<Device>(*this, row.open(index, {}));
    };
  }

 private:
  class Device final : public ForwardingBackend {
   public:
    Device(FaultyDevices& devices, std::unique_ptr<Backend> inner)
        : ForwardingBackend(std::move(inner)), devices_(devices) {
      info_.software &= !devices.is_hardware_;
      set_state_source([this] {
        const int nth = devices_.states_told_++;
        return devices_.state_of_ ? devices_.state_of_(nth) : inner_->state();
      });
    }
    std::unique_ptr<Texture> upload(const TextureDesc& desc) override {
      enter(FaultyDevices::upload);
      return ForwardingBackend::upload(desc);
    }
    std::unique_ptr<Pipeline> compile(const PipelineDesc& desc) override {
      enter(FaultyDevices::compile);
      if (desc.label == "load" && desc.target.by_compute) devices_.had_compute_audit_ = true;
      return ForwardingBackend::compile(desc);
    }
    BatchTime render(std::span<const Draw> frame, int frames, Timer timer) override {
      const int nth = devices_.calls(draw);
      const bool is_timed = enter(draw) != Fault::invalid_timer;
      BatchTime time = ForwardingBackend::render(frame, frames, timer);
      if (devices_.times_of_ && time.device_ns) time.device_ns = time.wall_ns;
      if (!is_timed) time.wall_ns = 0;
      if (nth >= devices_.slow_from_ && nth < devices_.slow_to_) time.wall_ns *= devices_.factor_;
      return time;
    }
    ComputeResult compute(const ComputeJob& job) override {
      const int nth = devices_.calls(FaultyDevices::compute);
      enter(FaultyDevices::compute);
      ComputeResult result = ForwardingBackend::compute(job);
      if (devices_.times_of_) result.times = devices_.times_of_(nth);
      return result;
    }

   private:
    Fault enter(Call call) {
      if (is_lost_) fail_device(Fault::device_lost, "still lost");
      try {
        return devices_.count(call);
      } catch (const Error& error) {
        is_lost_ = needs_reopening(error.fault());
        if (error.fault() == Fault::timeout) set_gone();
        throw;
      }
    }

    FaultyDevices& devices_;
    bool is_lost_ = false;
  };

  /// Throws the fault of this call, if it has one; one of timers is returned.
  Fault count(Call call) {
    const std::lock_guard lock(mutex_);  // compile() is called on several threads
    const auto found = faults_.find({call, calls_.at(call)++});
    if (found == faults_.end()) return Fault::other;
    if (found->second != Fault::invalid_timer) fail_device(found->second, "injected");
    return found->second;
  }

  std::map<std::pair<Call, int>, Fault> faults_;
  std::array<int, 5> calls_{};
  std::mutex mutex_;
  int slow_from_ = 1 << 30;
  int slow_to_ = 1 << 30;
  double factor_ = 1;
  bool is_hardware_ = false;
  std::function<DeviceState(int)> state_of_;
  std::function<std::vector<ComputeTime>(int)> times_of_;
  int states_told_ = 0;
  bool had_compute_audit_ = false;
};

}  // namespace reliefbench
