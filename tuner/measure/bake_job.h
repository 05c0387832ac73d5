#pragma once
#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "backends/backend.h"
#include "backends/timer_audit.h"
#include "kernels/image/heightmap.h"
#include "kernels/maps/map_verify.h"
#include "tuner/measure/bake.h"
#include "tuner/measure/repeated_bake.h"
#include "tuner/measure/session.h"

namespace reliefbench {

inline constexpr double kBandLimit_s = 60;
inline constexpr double kSoftwareBandLimit_s = 600;

/// One map, from heightmap to file.
struct BakeJob {
  HeightmapSpec heightmap;
  BakeSpec spec;
  std::string device = "cpu";  ///< cpu | opengl | vulkan
  int device_index = 0;        ///< within that backend
  /// Bakes whose times' medians are taken; none: 1, or kHardwareBakes on a GPU, after one that counts for nothing.
  std::optional<int> repeat{};
  bool verify = false;
  std::filesystem::path output;  ///< .ktx2, .exr or .png; empty: none
  /// A band of a GPU's bake (about a second's work) that takes longer ends it, where the device is in a process of its
  /// own; none: kBandLimit_s, on a software rasteriser kSoftwareBandLimit_s
  std::optional<double> timeout_s{};
  OpenDevice open = open_device;
};

struct BakeResult {
  std::string reading{};  ///< what was read of the heightmap's file; "" of a procedural one
  int width = 0;
  int height = 0;
  double bake_time_ns = 0;                  ///< on the host's clock, without the way to another process and back
  std::optional<double> pack_time_ns{};     ///< of encoding and packing, where the processor did it
  std::optional<DeviceInfo> device{};       ///< a GPU's bake
  std::vector<ComputeTime> device_times{};  ///< likewise, on its own clock, if that is believed
  std::optional<TimerAudit> clock{};        ///< what was found of that clock; none: it has none
  double mean_ratio = 0;                    ///< of the ratios as stored; a map without ratios: 0
  double closed_share = 0;                  ///< of ratios that are stored as 0
  std::size_t bytes = 0;                    ///< of all textures
  std::optional<MapVerdict> verdict;
  std::vector<std::filesystem::path> files;
};

/// The correction that the technique whose first map this is has as its default, else the kind's first.
[[nodiscard]] Correction default_correction(const MapRow& map);
/// The first format of 16 bits a channel that the map fits.
/// throws: Error(bad_input) with the first reason if none does
[[nodiscard]] const Format& default_format(const MapRow& map, const Encoding& encoding, Correction correction,
                                           float max_ratio);

/// What a map's file says of it.
[[nodiscard]] std::map<std::string, std::string> map_metadata(const BakeSpec& spec);

/// Loads, bakes, packs, verifies and writes.
/// throws: Error(bad_input): a conflict, an unreadable heightmap, an unwritable file; Error(environment): no such
///         device or no baker for it
[[nodiscard]] BakeResult run_bake(const BakeJob& job);

}  // namespace reliefbench
