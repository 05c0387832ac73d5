#pragma once
#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tuner/plan/case.h"

namespace reliefbench {

/// One line of a paper's table: a setting, and the paper's figures for it by metric.
struct ClaimRow {
  std::string label;
  Settings settings;
  std::map<std::string, double> paper;
};

/// What a paper says of its table. Exactly one form:
///  of `metric` less than that of `than`; or its quotient to that of `to` is `quotient` (within `tolerance`, relative);
///  or it is at most `at_most`.
struct ClaimCheck {
  std::string says;  ///< the claim in words
  std::string metric;
  std::string of;
  std::string than{};
  std::string to{};
  double quotient = 0;
  double tolerance = 0;
  std::optional<double> at_most{};
};

/// configs/claims/*.json: a table or figure of a paper, re-run.
struct Claim {
  std::string id;
  std::string source;
  std::string about;
  SceneSpec scene;
  std::vector<std::string> metrics;  ///< columns, besides the paper's
  std::vector<ClaimRow> rows;
  std::vector<ClaimCheck> checks;
};
/// throws: Error(bad_input) "FILE:LINE: key 'a.b': what was expected"
[[nodiscard]] Claim parse_claim(const std::string& text, const std::filesystem::path& path);
[[nodiscard]] std::vector<Claim> built_in_claims();

/// A metric of a claim: one of kernels/judge/score.h, or of the list below.
///  frame_time  ms, median of the shaded frame       bake_time  ms, one thread of the processor
///  mean_ratio  of the map's first ratio             too_wide   share of texels wider than the exact conservative cone
[[nodiscard]] bool is_claim_metric(std::string_view id);

enum class ClaimVerdict { reproduced, not_reproduced, not_testable };
[[nodiscard]] std::string_view claim_verdict_id(ClaimVerdict verdict);

struct ClaimAnswer {
  ClaimVerdict verdict = ClaimVerdict::not_testable;
  std::string numbers;  ///< "0.12 texels against 0.34", the paper's beside ours where it has one
};

/// A claim as it came out on one device.
struct ClaimResult {
  const Claim* claim = nullptr;
  std::string backend;
  std::string device;
  bool is_software = false;
  std::vector<std::map<std::string, double>> measured;  ///< parallel to Claim::rows; by metric
  std::vector<ClaimAnswer> answers;                     ///< parallel to Claim::checks
};

struct ClaimOptions {
  std::vector<std::string> backends;
  int device = 0;
  bool quiet = false;
};
/// Runs the claims on every backend. Times on a software rasteriser are measured and shown, but decide nothing: checks
/// of them are `not_testable`.
/// throws: Error(environment): no such device, no valid timer
[[nodiscard]] std::vector<ClaimResult> run_claims(std::span<const Claim> claims, const ClaimOptions& options);

/// How a check comes out on what was measured.
[[nodiscard]] ClaimAnswer judge_claim(const Claim& claim, const ClaimCheck& check,
                                      std::span<const std::map<std::string, double>> measured, bool is_software);

[[nodiscard]] nlohmann::json claims_json(std::span<const ClaimResult> results);

}  // namespace reliefbench
