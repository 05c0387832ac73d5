#include "tuner/search/rounds.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace reliefbench {
namespace {

constexpr double kOpenGap = std::numeric_limits<double>::infinity();

void add_once(std::vector<std::size_t>& round, std::size_t candidate) {
  if (std::ranges::find(round, candidate) == round.end()) round.push_back(candidate);
}

}  // namespace

Rounds::Rounds(const SearchSpace& space, const Chains& chains, const Gaps& gaps, const Gaps& known,
               const std::vector<Observed>& observed, double epsilon)
    : space_(space), chains_(chains), gaps_(gaps), known_(known), observed_(observed), goal_(std::log1p(epsilon)) {}

void Rounds::add_contenders(std::vector<std::size_t>& round) const {
  for (const WideGap& gap : known_.wider_than(goal_, kGaps)) {
    add_once(round, gap.rival);
    add_once(round, gap.pick);
  }
}

std::vector<std::size_t> Rounds::race(std::span<const WideGap> wide) const {
  std::vector<std::size_t> round;
  for (const WideGap& gap : wide) {
    const std::size_t rival = sharpest_rival(gap);
    add_once(round, rival);
    const bool has_pick = gap.log_gap < kOpenGap && gap.pick != rival;
    if (has_pick && width(gap.pick) > kPickIsSharp * width(rival)) add_once(round, gap.pick);
  }
  widen(round, wide.front());
  return round;
}

std::optional<std::size_t> Rounds::companion_of(std::size_t alone) const {
  const auto is_other = [&](std::size_t i) { return i != alone && observed_[i].is_measured(); };
  const WideGap widest = known_.widest();
  if (is_other(widest.rival)) return widest.rival;
  if (is_other(widest.pick)) return widest.pick;
  for (const std::size_t i : gaps_.by_error()) {
    if (is_other(i)) return i;
  }
  return {};
}

/// Adds settings that will have to be drawn for the gap, too.
void Rounds::widen(std::vector<std::size_t>& round, const WideGap& gap) const {
  if (round.size() < kLeastRound && gap.log_gap < kOpenGap) {
    WideGap next = gap;
    for (const std::size_t rival : gaps_.next_rivals(gap, gaps_.upper(gap.pick) - goal_, kMostRivals)) {
      if (round.size() == kLeastRound) break;
      next.rival = rival;
      add_once(round, sharpest_rival(next));
    }
  }
  while (round.size() < kLeastRound) {
    const std::optional<std::size_t> unknown = unbounded(round);
    const std::size_t before = round.size();
    if (unknown) add_once(round, smallest_alike(*unknown, gap.budget));
    if (round.size() == before) break;
  }
}

/// The setting to draw for the rival's side of a gap. A rival that was not timed shares its bound with others: the
/// smallest of its chain within the budget is drawn, as its bound then holds for all of them.
std::size_t Rounds::sharpest_rival(const WideGap& widest) const {
  if (observed_[widest.rival].is_measured()) return widest.rival;
  const bool is_known = gaps_.lower(widest.rival) > -kOpenGap;
  return smallest_alike(is_known ? widest.rival : unbounded({}).value_or(widest.rival), widest.budget);
}

std::size_t Rounds::smallest_alike(std::size_t rival, double budget) const {
  const double bound = gaps_.lower(rival);
  for (const std::size_t smaller : chains_.smaller(rival)) {
    const bool is_within = space_.candidates[smaller].error <= budget || bound == -kOpenGap;
    if (observed_[smaller].is_measured() || !is_within || gaps_.lower(smaller) > bound) continue;
    if (chains_.smaller(smaller).size() < chains_.smaller(rival).size()) rival = smaller;
  }
  return rival;
}

/// Of the settings that have no bound, but for those of the round, the one that the surrogate believes to be fastest.
std::optional<std::size_t> Rounds::unbounded(std::span<const std::size_t> round) const {
  std::optional<std::size_t> fastest;
  for (const std::size_t i : gaps_.by_error()) {
    if (gaps_.lower(i) > -kOpenGap || std::ranges::find(round, i) != round.end()) continue;
    if (!fastest || expected_[i] < expected_[*fastest]) fastest = i;
  }
  return fastest;
}

}  // namespace reliefbench
