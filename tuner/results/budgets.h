#pragma once
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tuner/plan/config.h"
#include "tuner/results/record.h"

namespace reliefbench {

/// A metric's value; nothing where the record has none (not ok, or psnr of identical pictures).
[[nodiscard]] std::optional<double> metric_value(const Record& record, std::string_view metric_id);
/// Whether a value of the budget's metric is within it; for higher-is-better metrics the limit is a least value, and a
/// missing psnr (identical pictures) is within.
[[nodiscard]] bool within(std::optional<double> value, const Budget& budget);
[[nodiscard]] bool meets(const FrameScore& score, const Budget& budget);
/// Whether the record is ok and within the budget.
[[nodiscard]] bool meets(const Record& record, const Budget& budget);

/// The first of the bounds on a metric; nothing where there is none.
[[nodiscard]] std::optional<double> limit_on(std::string_view metric_id, std::span<const Budget> budgets);

/// Those on other metrics: what a question for the least of this one still keeps.
[[nodiscard]] std::vector<Budget> budgets_beside(std::string_view metric_id, std::span<const Budget> budgets);

/// What some metrics' values miss of their budgets.
struct Miss {
  double worst = 0;    ///< relative to the limit (to 1 where the limit is 0); 0 where all are within
  std::string text{};  ///< "e_xy.p99 is 0.61 where 0.5 is asked, ..."; "" where all are within
};
/// By how much a value is beyond its limit, relative to the limit (to 1 where the limit is 0).
[[nodiscard]] double relative_miss(double excess, double limit);
/// value: of a budget's metric
[[nodiscard]] Miss miss_of(std::span<const Budget> budgets,
                           const std::function<std::optional<double>(const Budget&)>& value);
[[nodiscard]] Miss miss_of(std::span<const Budget> budgets, const FrameScore& score);

}  // namespace reliefbench
