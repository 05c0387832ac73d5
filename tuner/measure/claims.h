#pragma once
#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tuner/measure/session.h"
#include "tuner/plan/claims_config.h"

namespace reliefbench {

enum class ClaimVerdict { reproduced, not_reproduced, not_testable };
[[nodiscard]] std::string_view claim_verdict_id(ClaimVerdict verdict);

struct ClaimAnswer {
  ClaimVerdict verdict = ClaimVerdict::not_testable;
  std::string numbers;  ///< "0.12 texels against 0.34", the paper's beside ours where it has one
};

/// What was measured of a row.
struct ClaimFigures {
  std::map<std::string, double> values{};  ///< by metric
  std::vector<double> times_ns{};          ///< of its frames, one a round; the same rounds as the other rows'
};

/// A claim as it came out on one device.
struct ClaimResult {
  const Claim* claim = nullptr;
  std::string backend;
  std::string device;
  bool is_software = false;
  std::vector<ClaimFigures> measured;  ///< parallel to Claim::rows
  std::vector<ClaimAnswer> answers;    ///< parallel to Claim::checks
};

struct ClaimOptions {
  std::vector<std::string> backends;
  int device = 0;
  bool quiet = false;
  OpenDevice open = open_device;
};
/// Runs the claims on every backend. Times on a software rasteriser are measured and shown, but decide nothing: checks
/// of them are `not_testable`.
/// throws: Error(environment): no such device, no valid timer
[[nodiscard]] std::vector<ClaimResult> run_claims(std::span<const Claim> claims, const ClaimOptions& options);

/// How a check comes out on what was measured.
[[nodiscard]] ClaimAnswer judge_claim(const Claim& claim, const ClaimCheck& check,
                                      std::span<const ClaimFigures> measured, bool is_software);

[[nodiscard]] nlohmann::json claims_json(std::span<const ClaimResult> results);

}  // namespace reliefbench
