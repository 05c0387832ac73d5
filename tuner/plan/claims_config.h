#pragma once
#include <filesystem>
#include <map>
#include <optional>
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
  std::string source{};  ///< where an engine's setting is from, ""
};

/// What a paper says of its table. Exactly one form:
///  of `metric` less than that of `than`; or its quotient to that of `to` is `quotient` (within `tolerance`, relative)
///  or at most `at_most`; or it is at most `at_most`. Of several scenes it holds in each.
/// Or a contest over all scenes, of geometric means:
///  `of` is beaten by the fastest of `beaten_by` in each scene that has no more of `metric` there, nor more misses;
///  told beside it is one setting for all of them; or of those that are so held against each of `of_each`, `beaten_by`
///  have a faster one than `rather_than`; or the fastest in each scene is faster by `by_factor`: than each of
///  `of_each`; or, of those with at most `at_most` of `metric`, than the fastest of `best_of`.
/// Lists of labels may have globs. `of_each` with neither `rather_than` nor `by_factor` is read as a check `of` each,
/// whose label stands where `says` has "{}".
struct ClaimCheck {
  std::string says;   ///< the claim in words
  std::string why{};  ///< it is not reproduced, where that is known: found by measuring
  std::string metric;
  std::string of;
  std::string than{};
  std::string to{};
  double quotient = 0;
  double tolerance = 0;
  std::optional<double> at_most{};
  std::vector<std::string> beaten_by{};
  std::vector<std::string> of_each{};
  std::vector<std::string> best_of{};
  std::vector<std::string> rather_than{};
  double by_factor = 0;
  [[nodiscard]] bool is_contest() const { return !beaten_by.empty(); }  ///< over all scenes
};

/// configs/claims/*.json: a table or figure of a paper, re-run.
struct Claim {
  std::string id;
  std::string source;
  std::string about;
  std::vector<SceneSpec> scenes;
  std::vector<std::string> metrics;  ///< columns, besides the paper's
  std::vector<ClaimRow> rows;
  std::vector<ClaimCheck> checks;

  [[nodiscard]] bool is_contest() const;                       ///< all checks are
  [[nodiscard]] bool asks_for(std::string_view metric) const;  ///< as a column or in a check
  /// Of the row with that label, which there is.
  [[nodiscard]] std::size_t row_index(std::string_view label) const;
};
/// throws: Error(bad_input) "FILE:LINE: key 'a.b': what was expected"
[[nodiscard]] Claim parse_claim(const std::string& text, const std::filesystem::path& path);
[[nodiscard]] std::vector<Claim> built_in_claims();

/// A metric of a claim: one of kernels/judge/score.h, or of the list below.
///  frame_time  ms, median of the shaded frame
///  bake_time   ms: on hardware of the kind's GPU baker, on the device's clock without upload and read-back; beside a
///              software rasteriser of one thread of the processor
///  mean_ratio  of the map's first ratio             too_wide   share of texels wider than the exact conservative cone
///  violations  places where the map as it is stored breaks its kind's promise, as `bake --verify` counts them
///  undecided   cells of which it finds neither that they keep it nor that they break it
[[nodiscard]] bool is_claim_metric(std::string_view id);

}  // namespace reliefbench
