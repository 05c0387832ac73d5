#pragma once
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "kernels/base/error.h"
#include "tuner/plan/config.h"
#include "tuner/results/budgets.h"
#include "tuner/results/record.h"

namespace reliefbench {

struct Question {
  std::vector<Budget> budgets;            ///< all must hold
  std::optional<double> max_time_ms{};    ///< then: the most accurate within it; else: the fastest within the budgets
  std::string error_metric = "e_xy.p99";  ///< what "most accurate" means, and what decides between equal times
  /// What the simplest must meet besides: of a question about time alone the run's own budgets, or the simplest would
  /// be no relief at all, which takes the least time however wrong it is.
  std::vector<Budget> simplest_budgets{};
  std::optional<int> rebake_every{};  ///< of records that add_bakes() changed: what it was told
};

/// The answer for one device and scene. Pointers go into the records that were asked.
struct Answer {
  std::string backend;
  std::string device;
  std::string scene;
  SceneKey scene_key{};
  const Record* pick = nullptr;       ///< null: nothing meets the question
  const Record* tie = nullptr;        ///< Choice::tie: as fast as the pick as far as can be told, or faster
  std::size_t ties = 0;               ///< how many are
  const Record* runner_up = nullptr;  ///< the best of the others by time (with max_time_ms: by error)
  const Record* simplest = nullptr;   ///< simplest of all that meet the question and simplest_budgets; null: none does
  std::size_t simpler = 0;            ///< measured settings that are simpler than the pick, whatever their error
  const Record* flat = nullptr;       ///< the floor of frame time, whatever its error
  const Record* nearest = nullptr;    ///< where pick is null: the one that comes nearest; null: nothing was measured
  /// Where there is a pick: of the settings that are faster and miss a budget, the one that misses least.
  const Record* just_fails = nullptr;
  std::string miss{};  ///< where pick is null: "e_xy.p99 is 0.61 where 0.5 is asked"
};

/// Time by which a case is judged: the upper end of its interval, never the luckiest median. ns
[[nodiscard]] double judged_time_ns(const Record& record);

/// What a case's map takes once more: its device's own time where that was measured, else the processor's.
[[nodiscard]] double rebake_ns(const Record& record);

/// Of a heightmap that changes every so many frames: each frame bears its share of rebake_ns().
/// What is judged, compared and printed from then on is this sum.
void add_bakes(std::span<Record> records, int rebake_every);

/// One answer a (backend, device, scene), also where nothing of it was measured. Order of cases: judged time (with
/// max_time_ms: error), then error (judged time), then case id. The pick is choose()'s among all that meet the question
/// (with max_time_ms: among those of them that have the least error). The nearest is the one whose worst miss, relative
/// to the limit (to 1 where the limit is 0), is the smallest. throws: Error(bad_input): no such metric
[[nodiscard]] std::vector<Answer> recommend(std::span<const Record> records, const Question& question);

/// 0, 1 where some answer has no pick, 5 where nothing at all was measured.
[[nodiscard]] Exit exit_of(std::span<const Answer> answers);

[[nodiscard]] nlohmann::json answers_json(std::span<const Answer> answers, const Question& question);

}  // namespace reliefbench
