#pragma once
#include <map>
#include <memory>
#include <span>
#include <string>

#include "tuner/measure/prepare.h"
#include "tuner/measure/timing.h"

namespace reliefbench {

/// Times cases in rounds; prepares each when it is first asked for.
class DeviceTimes {
 public:
  DeviceTimes(const Timing& timing, Preparer& preparer) : timing_(timing), preparer_(preparer) {}

  struct Wanted {
    Case spec;
    const SceneSpec* scene = nullptr;
  };
  /// time() of these cases. throws: CaseFailed
  void draw(std::span<const Wanted> round);
  /// Frees what it has on the device, which is made again when it is needed.
  void release() { ready_.clear(); }

 private:
  struct Ready {
    Case spec;
    PreparedCase prepared;
    TimedCase timed;
  };
  [[nodiscard]] const TimedCase& ready(const Wanted& wanted);

  Timing timing_;
  Preparer& preparer_;
  std::map<std::string, std::unique_ptr<Ready>> ready_;  // by case id
};

}  // namespace reliefbench
