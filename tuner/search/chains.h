#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "tuner/search/observations.h"
#include "tuner/search/space.h"

namespace reliefbench {

/// The order of settings by their work: a is smaller than b if both have the same categories and no step count of a is
/// larger, some one smaller. Then a should be no slower. That is an assumption (more steps can end others early), so it
/// comes with a slack.
class Chains {
 public:
  explicit Chains(const SearchSpace& space);
  [[nodiscard]] std::span<const std::size_t> smaller(std::size_t candidate) const { return smaller_[candidate]; }
  [[nodiscard]] std::span<const std::size_t> larger(std::size_t candidate) const { return larger_[candidate]; }

 private:
  std::vector<std::vector<std::size_t>> smaller_;  // feasible candidates only, by index
  std::vector<std::vector<std::size_t>> larger_;
};

/// The slack on the log scale: the kSlackQuantile of how much faster a timed setting was than the slowest timed setting
/// below it, less one standard error of their difference, over all timed settings that have one below. At least
/// kLeastSlack; kPriorSlack while there are fewer than kSlackPairs.
[[nodiscard]] double estimate_slack(const Chains& chains, std::span<const Observed> observed,
                                    std::span<const double> scales);
inline constexpr double kSlackQuantile = 0.98;
inline constexpr double kLeastSlack = 0.01;
inline constexpr double kPriorSlack = 0.1;
inline constexpr std::size_t kSlackPairs = 20;

}  // namespace reliefbench
