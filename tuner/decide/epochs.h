#pragma once
#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "tuner/history/rows.h"

namespace reliefbench {

/// Which nights of a device may be compared: those of one environment, as far as it is the device's own (the host and
/// its entry). What becomes of a machine's other devices is no matter. An environment that comes back goes on with its
/// epoch.
class Epochs {
 public:
  explicit Epochs(const HistoryView& view);

  /// The epoch of a device that a run measured: the run that it began with, an index in view.runs.
  [[nodiscard]] std::size_t of(std::size_t run, const std::string& device) const { return begins_[run].at(device); }

  /// The epoch of a run's machine: one more wherever a device is in another environment than before.
  [[nodiscard]] std::size_t of_machine(std::size_t run) const { return of_machines_[run]; }

 private:
  std::vector<std::map<std::string, std::size_t>> begins_;  ///< of each run's devices
  std::vector<std::size_t> of_machines_;                    ///< by run
};

}  // namespace reliefbench
