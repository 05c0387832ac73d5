#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tuner/plan/case.h"

namespace reliefbench {

/// What a batch may take at least, whatever `timeout_s` says: a busy machine takes that long for anything.
inline constexpr double kLeastRenderLimit_s = 1;
inline constexpr double kLongestBatch_ms = 60'000;

/// How frame times are taken.
struct MeasureSpec {
  int samples = 7;             ///< batches a case
  double batch_ms = 5;         ///< least length of a batch, shorter than it may take
  int warmup_batches_max = 6;  ///< warm-up ends when two batches in a row agree within 5 %, or here
  int control_every = 4;       ///< samples between two samples of the control case
  int block_cases = 32;        ///< cases that are interleaved with each other
  int flicker_frames = 0;      ///< frames of a camera that moves 1/4 texel each, for the metric flicker; 0: none
  double timeout_s = 20;       ///< a frame that takes longer ends its case with status `timeout`
};

/// An error bound: "e_xy.p99<=0.5". The metric is one of kernels/judge/score.h.
struct Budget {
  std::string metric;
  double limit = 0;
  [[nodiscard]] std::string text() const;
};
[[nodiscard]] Budget parse_budget(std::string_view text);  ///< throws: Error(bad_input)
[[nodiscard]] std::vector<Budget> parse_budgets(std::span<const std::string> texts);
[[nodiscard]] std::vector<std::string> budget_texts(std::span<const Budget> budgets);  ///< parse_budgets() of it again

/// An axis of a sweep: one parameter, or several linked ones that move together.
struct Axis {
  std::vector<std::string> params;
  std::vector<std::vector<int>> values;  ///< one tuple a step; parallel to params
};

/// "where": if every `when` holds then every `then` must hold; parameter -> allowed values.
struct WhereRule {
  std::vector<std::pair<std::string, std::vector<int>>> when;
  std::vector<std::pair<std::string, std::vector<int>>> then;
};

struct SweepSpec {
  const Technique* technique = nullptr;
  std::vector<Axis> axes;
  bool zip = false;  ///< axes advance together instead of multiplying
  std::vector<WhereRule> where;
  int line = 0;  ///< in the config, for messages
};

struct Config {
  std::filesystem::path path;
  std::string text;  ///< as read
  std::string name;
  std::uint64_t seed = 1;
  std::vector<std::string> included;  ///< text of the presets files that it names: what it means depends on them
  std::vector<SceneSpec> scenes;
  std::vector<SweepSpec> sweeps;
  MeasureSpec measure;
  std::string front_error = "e_xy.p99";  ///< the front's error axis
  std::vector<Budget> front_constraints = {{"missed_rate", 0.001}};
  std::vector<Budget> budgets = {{"e_xy.p99", 0.5}, {"missed_rate", 0.001}};  ///< of the recommendation
};

/// Reads a JSON config; // and /* */ comments allowed. Unknown keys, wrong types, unknown names, empty selections:
/// throws: Error(bad_input) "FILE:LINE: key 'a.b': what was expected"
[[nodiscard]] Config load_config(const std::filesystem::path& path);
[[nodiscard]] Config parse_config(std::string text, const std::filesystem::path& path);

}  // namespace reliefbench
