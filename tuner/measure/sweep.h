#pragma once
#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tuner/measure/device_bake.h"
#include "tuner/measure/draw_block.h"
#include "tuner/measure/pictures.h"
#include "tuner/measure/session.h"
#include "tuner/measure/timing.h"
#include "tuner/measure/wall_split.h"
#include "tuner/plan/config.h"
#include "tuner/plan/shard.h"
#include "tuner/results/record.h"

namespace reliefbench {

struct SweepOptions {
  std::filesystem::path output;
  std::vector<std::string> backends;  ///< ids, in order
  int device = 0;                     ///< index on each of them
  std::string filter{};               ///< glob on case ids; "" = all
  std::string key{};                  ///< of the one setting to measure; "" = all
  std::optional<Shard> shard{};       ///< of those cases; none: all
  bool retry_failed = false;          ///< draw again what failed in an earlier start
  Pictured pictures = Pictured::shown;
  DeviceBakes device_bakes = DeviceBakes::hardware;
  Slowdowns slowdowns{};
  bool quiet = false;  ///< no progress
  OpenDevice open = open_device;
  double cooling_pause_s = kCoolingPause_s;
};

/// What a sweep did, for its last lines and for run.json.
struct SweepSummary {
  std::filesystem::path folder{};
  int cases = 0;
  int resumed = 0;                        ///< of them finished by an earlier start
  int open = 0;                           ///< of them failed, and drawn again by the next start
  std::map<std::string, int> statuses{};  ///< status id -> cases
  int held_back = 0;                      ///< blocks that do not count
  int bakes = 0;
  int bakes_cached = 0;
  int references = 0;
  int references_cached = 0;
  int shaders = 0;
  int shaders_cached = 0;
  std::vector<std::string> notes{};  ///< two_devices_note(), DefaultFrame::why, held_back_note(), small_frame_notes()
  std::array<double, kPartIds.size()> part_s{};
  double other_s = 0;
  double total_s = 0;
};

/// Config -> cases -> maps -> textures -> samples and hits -> scores -> records -> front, into a run folder.
/// Continues an interrupted run of the same config on the same devices. Nothing is measured twice, but a case whose
/// failure may have passed (may_pass) is tried once more: by the next start, or after a crash by this one, by itself
/// and last. A device that is lost is opened again; only the case that lost it fails. When a device's cases are done,
/// those that get pictures are drawn once more, also for a run that was complete before. throws: Error: bad config or
/// input, unwritable folder, another run's folder, no such device. Nothing is written
///         before config, heightmaps and devices have been found good.
[[nodiscard]] SweepSummary run_sweep(Config config, const SweepOptions& options);

/// That the backends draw on different hardware, as where one index means one device in OpenGL and another in Vulkan;
/// "" where they do not, or do not both tell a PCI address.
[[nodiscard]] std::string two_devices_note(std::span<const DeviceInfo> drawing);

/// The backends that `--backend` means: an id, or "all" for every real one that has a device.
/// throws: Error: unknown id; none has a device
[[nodiscard]] std::vector<std::string> choose_backends(const std::string& name);

}  // namespace reliefbench
