#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <vector>

#include "tuner/measure/device_bake.h"
#include "tuner/measure/device_run.h"
#include "tuner/measure/record_book.h"
#include "tuner/plan/plan.h"

namespace reliefbench {

/// Cases whose rounds of samples are drawn together.
using Block = std::vector<const Case*>;

/// One device's share of a sweep.
class DeviceSweep {
 public:
  /// folder: of the run
  DeviceSweep(Session& session, const RunParts& parts, RecordBook& book, std::filesystem::path folder,
              DeviceBakes device_bakes);

  /// blocks: of this device's cases that are to be drawn. on_progress: with the number of cases done so far
  void run(const std::vector<Block>& blocks, const std::function<void(double)>& on_progress);
  /// pictured: of all devices
  void draw_pictures(const std::set<const Record*>& pictured, const Plan& plan, Progress& progress);
  [[nodiscard]] const Preparer& preparer() const { return run_.preparer; }

 private:
  void run_block(const Block& block, const std::function<void(double)>& on_progress);
  /// Compiles a block's shaders at once, until the device is lost over it or an earlier start ended in a case: then
  /// each in its own case, so that it is known which one it was. Software rasterisers compile at the first draw.
  void compile_ahead(const Block& block);
  /// Samples the cases of a block that are ok. One that fails in its frames gets its status, and the others go on.
  void sample(std::vector<PreparedCase>& block, const std::function<void(double)>& on_progress);
  /// Warms the cases up, then draws each once a round, in an order that is shuffled anew, until all have their samples.
  void time_block(const std::vector<PreparedCase>& block, const std::function<void(double)>& on_progress);
  /// Times the bakes of a block's maps by the device, when all else of it is done. One that kills the device costs its
  /// case nothing but that figure; a case in which an earlier start ended goes without.
  void bake_on_device(std::vector<PreparedCase>& block);
  /// Opens the lost device again; what the block had on it is gone.
  void reopen(std::vector<PreparedCase>& block);
  /// Uploads and draws again what a block had on a lost device.
  void make_drawable(std::vector<PreparedCase>& block);

  const Config& config_;
  WallSplit& split_;
  Session& session_;
  RunStore& store_;
  RecordBook& book_;
  std::filesystem::path folder_;
  bool is_compiled_alone_;
  DeviceRun run_;
  std::optional<DeviceBakeTimes> bake_times_{};  ///< none: not asked for
};

}  // namespace reliefbench
