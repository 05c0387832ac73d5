#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "tuner/search/chains.h"
#include "tuner/search/gaps.h"
#include "tuner/search/observations.h"
#include "tuner/search/space.h"

namespace reliefbench {

/// Says of which settings the search draws a block next: those that decide the widest gaps, and company for them, so
/// that no setting's frames follow each other.
class Rounds {
 public:
  /// gaps: of all settings; known: of those timed so far. All are kept by reference.
  Rounds(const SearchSpace& space, const Chains& chains, const Gaps& gaps, const Gaps& known,
         const std::vector<Observed>& observed, double epsilon);
  /// log_times: what the surrogate believes, one a candidate. Before the first race().
  void expect(std::vector<double> log_times) { expected_ = std::move(log_times); }

  /// Adds the settings that decide the widest gaps among those timed so far.
  void add_contenders(std::vector<std::size_t>& round) const;
  /// The rivals of these gaps, and those picks that are not much better known; kLeastRound settings at least where so
  /// many will have to be drawn. wide: the widest first, not empty
  [[nodiscard]] std::vector<std::size_t> race(std::span<const WideGap> wide) const;
  /// A setting that was timed, to be drawn between the frames of one that is alone: it decides the widest gap if it
  /// can. None where no other was timed.
  [[nodiscard]] std::optional<std::size_t> companion_of(std::size_t alone) const;

  static constexpr std::size_t kGaps = 8;         ///< that a round is drawn for, at most two settings each
  static constexpr std::size_t kLeastRound = 4;   ///< settings
  static constexpr std::size_t kMostRivals = 16;  ///< that are looked through for them
  static constexpr double kPickIsSharp =
      0.6;  ///< a pick whose bounds are so much narrower than its rival's is left out

 private:
  void widen(std::vector<std::size_t>& round, const WideGap& gap) const;
  [[nodiscard]] double width(std::size_t i) const { return gaps_.upper(i) - gaps_.lower(i); }
  [[nodiscard]] std::size_t sharpest_rival(const WideGap& widest) const;
  [[nodiscard]] std::size_t smallest_alike(std::size_t rival, double budget) const;
  [[nodiscard]] std::optional<std::size_t> unbounded(std::span<const std::size_t> round) const;

  const SearchSpace& space_;
  const Chains& chains_;
  const Gaps& gaps_;
  const Gaps& known_;
  const std::vector<Observed>& observed_;
  double goal_;  // log time
  std::vector<double> expected_;
};

}  // namespace reliefbench
