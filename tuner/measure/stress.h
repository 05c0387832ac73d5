#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/trace/shader_contract.h"
#include "tuner/measure/session.h"
#include "tuner/plan/extremes.h"

namespace reliefbench {

/// What every technique must keep at every extreme.
enum class StressCheck {
  finite,      ///< no NaN or infinity in a pixel
  inside,      ///< no hit outside the volume: t in [0, 1]
  step_cap,    ///< no more iterations than the settings allow
  repeatable,  ///< two frames have the same bits
  guarantee,   ///< what the settings claim: no missed first hit; exact: none left short before the cap
  agreement,   ///< the backends agree: no more pixels than Technique::disagreement differ by more than kAgreement in t
};
inline constexpr std::array<std::string_view, 6> kStressCheckIds{"finite",     "inside",    "step_cap",
                                                                 "repeatable", "guarantee", "agreement"};
inline constexpr double kAgreement = 1e-4;
/// What rays on a curved surface may differ by between backends: in place, and in slope as a share of it.
inline constexpr double kRayAgreement_texels = 1e-3;
inline constexpr double kPlaceUlps = 4;  ///< or this of the farthest coordinate, if that is more (llvmpipe's: 2.5)
inline constexpr double kRayAgreement = 1e-4;

/// One technique with one setting at one extreme on one backend (agreement: on the later backend).
struct StressResult {
  std::string extreme;
  std::string technique;
  std::string map;
  std::string format;
  std::string settings;
  std::string backend;
  Guarantee guarantee = Guarantee::none;
  std::string skipped{};  ///< why nothing was drawn; "" if it was
  bool is_lost = false;   ///< since the driver crashed, hung, or lost its device or memory over it
  /// Pixels at fault by StressCheck; 0 where the check holds.
  std::array<std::int64_t, kStressCheckIds.size()> faults{};
  std::int64_t pixels = 0;      ///< with a ray
  std::int64_t capped = 0;      ///< that ended at the step cap
  std::int64_t unresolved = 0;  ///< that floats can't tell from keeping the guarantee (Kept::unresolved)
  double missed_rate = 0;
  double unconverged_rate = 0;
  double e_xy_p99 = 0;  ///< texels
  double e_xy_max = 0;
  double differing_rate = 0;  ///< to the other backend

  [[nodiscard]] std::int64_t& fault(StressCheck check) { return faults.at(static_cast<std::size_t>(check)); }
  [[nodiscard]] std::int64_t fault(StressCheck check) const { return faults.at(static_cast<std::size_t>(check)); }
  [[nodiscard]] bool holds() const;
};

struct StressOptions {
  std::vector<std::string> backends;
  int device = 0;
  std::string filter;  ///< glob over "technique/map/format/extreme"; "" for all
  bool is_large = false;
  std::optional<SimulatedFilter> simulated{};  ///< then all that can reads with this sampler
  bool quiet = false;
  OpenDevice open = open_device;
  bool draws_at_once = false;  ///< each device from a thread of its own, as workers may; a GL context is of one thread
  /// A line for people on a result that does not hold, told as it comes.
  std::function<std::string(const StressResult&)> words = [](const StressResult&) { return std::string(); };
  std::function<void()> before_drawing = [] {};                 ///< called once devices and filter are found to do
  std::function<bool()> is_interrupted = [] { return false; };  ///< asked before each setting
};

/// The worst picture of a technique: the frame with the highest p99 error.
struct StressPicture {
  std::string technique;
  StressResult result;
  std::vector<std::uint8_t> rgba8;  ///< heat map of the error
  int width = 0;
  int height = 0;
};

struct StressReport {
  std::vector<std::string> techniques;
  std::vector<Extreme> extremes;
  std::vector<std::string> devices;  ///< "opengl: llvmpipe ..."
  std::vector<StressResult> results;
  std::vector<StressPicture> pictures;
  std::int64_t undone = 0;  ///< settings at extremes that an interrupted run did not come to
  double wall_s = 0;

  /// Whether all was done, and holds.
  [[nodiscard]] bool holds() const;
};

/// Runs every technique x map x format over the extremes.
/// throws: Error(environment): no such device; Error(bad_input): the filter matches nothing
[[nodiscard]] StressReport run_stress(const Extremes& extremes, const StressOptions& options);

/// stress.json: the matrix and every result (configs/schema/stress.schema.json).
[[nodiscard]] nlohmann::json stress_json(const StressReport& report);

inline constexpr std::string_view kStressFile = "stress.json";
inline constexpr int kStressSchema = 1;  ///< its layout; raised when that changes

}  // namespace reliefbench
