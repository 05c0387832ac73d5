#pragma once
#include "kernels/base/cache.h"
#include "tuner/measure/prepare.h"
#include "tuner/measure/progress.h"
#include "tuner/measure/sample_book.h"
#include "tuner/measure/timing.h"
#include "tuner/plan/config.h"
#include "tuner/results/store.h"

namespace reliefbench {

/// When a run was first started, and where this start of it goes on.
struct RunStart {
  explicit RunStart(const Run& earlier);
  double unix_ns;
  RunClock clock;
};

/// Settles what a session's times rest on, or goes on with what an earlier start of the run settled; and how well the
/// scenes' frames fill the device.
void calibrate(Session& session, const Config& config, const Run& earlier, WallSplit& split);

/// What all devices of a run share.
struct RunParts {
  const Config& config;
  MapLibrary& library;
  const Cache& cache;
  WallSplit& split;
  RunStore& store;
  const RunStart& start;
  Progress& progress;
  double cooling_pause_s = 0;
  const Slowdowns* slowdowns = nullptr;  ///< null: none
};

/// A run's cases on one device: their samples, what times them, and what prepares them.
struct DeviceRun {
  /// session: calibrated
  DeviceRun(Session& session, const RunParts& parts);
  DeviceRun(const DeviceRun&) = delete;
  DeviceRun& operator=(const DeviceRun&) = delete;

  SampleBook samples;
  Timing timing;  ///< into `samples`
  Preparer preparer;
};

}  // namespace reliefbench
