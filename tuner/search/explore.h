#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "tuner/search/observations.h"
#include "tuner/search/regret.h"
#include "tuner/search/space.h"
#include "tuner/search/surrogate.h"

namespace reliefbench {

/// Proposes settings to time, by what the surrogate expects of them. It never rules a setting out.
class Explorer {
 public:
  explicit Explorer(const SearchSpace& space, const std::optional<RegretRule>& regret = std::nullopt);

  /// The next settings, none timed so far, no two alike; fewer where fewer are left, none where the surrogate is full.
  /// Each batch's first maximises the expected hypervolume improvement; or, in all batches but each kVolumeEvery-th
  /// once the front is roughly known (kRough), the expected improvement at the setting's own error budget: the most
  /// over the budgets that it answers, so that this looks after the worst budget. The others follow as if the
  /// surrogate's mean had been measured (kriging believer; source: Ginsbourger, Le Riche & Carraro, 2010).
  ///
  /// With a regret rule: the expected improvement of the fastest of all, and of the least regret, whichever is more.
  [[nodiscard]] std::vector<std::size_t> propose(std::span<const Observed> observed, std::span<const double> scales);

  /// Of a feasible candidate.
  [[nodiscard]] double mean(std::size_t candidate) const { return surrogate_.mean(place_[candidate]); }
  [[nodiscard]] std::size_t capacity() const { return surrogate_.capacity(); }

  static constexpr std::size_t kBatch = 3;
  static constexpr double kShare = 0.1;  ///< of the settings are timed in the surrogate's order, ...
  static constexpr std::size_t kLeast = 32;
  static constexpr std::size_t kMost = 320;
  static constexpr double kRough = 0.04;  ///< of the settings
  static constexpr int kVolumeEvery = 4;  ///< batches

 private:
  void learn(std::span<const Observed> observed, std::span<const double> scales);

  std::optional<RegretRule> regret_;
  std::vector<std::size_t> feasible_;
  std::vector<double> errors_;      // parallel to feasible_
  std::vector<std::size_t> place_;  // in feasible_, which are the surrogate's settings; one a candidate
  std::vector<std::size_t> rank_;   // of the error, one a candidate
  std::size_t ranks_ = 0;
  Surrogate surrogate_;
  std::vector<std::size_t> learned_;  // candidates, in the surrogate's order
  std::vector<char> is_learned_;
  int batches_ = 0;
};

}  // namespace reliefbench
