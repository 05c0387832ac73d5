#include "tuner/search/gaps.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <tuple>
#include <utility>

namespace reliefbench {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::infinity();

}  // namespace

Gaps::Gaps(const SearchSpace& space, const std::optional<RegretRule>& regret)
    : regret_(regret), place_(space.candidates.size()) {
  for (std::size_t i = 0; i < space.candidates.size(); ++i) {
    if (space.candidates[i].is_feasible) candidates_.push_back(i);
  }
  std::ranges::sort(candidates_, [&](std::size_t a, std::size_t b) {
    return std::tie(space.candidates[a].error, a) < std::tie(space.candidates[b].error, b);
  });
  for (std::size_t place = 0; place < candidates_.size(); ++place) {
    place_[candidates_[place]] = place;
    error_.push_back(space.candidates[candidates_[place]].error);
  }
  lower_.assign(candidates_.size(), -kUnknown);
  upper_.assign(candidates_.size(), kUnknown);
  for (std::size_t place = 0; place < candidates_.size(); ++place)
    ends_budget_.push_back(place + 1 == candidates_.size() || error_[place + 1] > error_[place] ? 1 : 0);
}

void Gaps::set(std::size_t candidate, double lower, double upper) {
  lower_[place_[candidate]] = lower;
  upper_[place_[candidate]] = upper;
}

Gaps::Fastest Gaps::fastest() const {
  Fastest fastest;
  for (std::size_t place = 0; place < candidates_.size(); ++place) {
    fastest.lower = std::min(fastest.lower, lower_[place]);
    fastest.upper = std::min(fastest.upper, upper_[place]);
  }
  return fastest;
}

double Gaps::regret_low(std::size_t place, const Fastest& fastest) const {
  const double over = lower_[place] - fastest.upper;
  return regret_->regret(error_[place], std::exp(std::max(0.0, over)));
}

double Gaps::regret_high(std::size_t place, const Fastest& fastest) const {
  if (upper_[place] == kUnknown || fastest.lower == -kUnknown) return kUnknown;
  return regret_->regret(error_[place], std::exp(upper_[place] - fastest.lower));
}

Gaps::LeastRegret Gaps::least_regret() const {
  const Fastest all = fastest();
  LeastRegret least{.pick = 0, .low = kUnknown};
  for (std::size_t place = 0; place < candidates_.size(); ++place) {
    least.low = std::min(least.low, regret_low(place, all));
    const double high = regret_high(place, all);
    if (high >= least.high) continue;
    least.high = high;
    least.pick = candidates_[place];
  }
  return least;
}

/// Walks the budgets by rising error. Of settings with equal bounds, the more accurate decides.
class Gaps::Walk {
 public:
  explicit Walk(const Gaps& gaps) : gaps_(gaps) {
    if (!gaps.regret_) return;
    fastest_ = gaps.fastest();
    least_regret_ = gaps.least_regret().high;
  }

  /// Goes on to the next budget; false after the last.
  bool next() {
    if (is_last()) return false;
    is_asked_ = !gaps_.regret_;
    do {
      add(place_);
      is_asked_ = is_asked_ || gaps_.regret_low(place_, fastest_) < least_regret_;
    } while (gaps_.ends_budget_[place_++] == 0);
    is_asked_ = is_asked_ || is_last();
    return true;
  }
  [[nodiscard]] bool is_last() const { return place_ == gaps_.candidates_.size(); }
  [[nodiscard]] double budget() const { return gaps_.error_[place_ - 1]; }
  [[nodiscard]] bool has_pick() const { return gaps_.upper_[pick_] < kUnknown; }
  [[nodiscard]] std::size_t pick() const { return gaps_.candidates_[pick_]; }
  [[nodiscard]] std::size_t rival() const { return gaps_.candidates_[is_least_pick() ? second_ : least_]; }
  /// Infinite if there is no other setting.
  [[nodiscard]] double rival_lower() const { return is_least_pick() ? second_lower_ : gaps_.lower_[least_]; }
  [[nodiscard]] double log_gap() const {
    if (!is_asked_) return 0;
    if (!has_pick()) return kUnknown;
    return std::max(0.0, gaps_.upper_[pick_] - rival_lower());
  }

 private:
  void add(std::size_t place) {
    if (place == 0) return;
    if (gaps_.upper_[place] < gaps_.upper_[pick_]) pick_ = place;
    const double lower = gaps_.lower_[place];
    if (lower < gaps_.lower_[least_]) {
      second_lower_ = gaps_.lower_[least_];
      second_ = std::exchange(least_, place);
    } else if (lower < second_lower_) {
      second_lower_ = lower;
      second_ = place;
    }
  }
  [[nodiscard]] bool is_least_pick() const { return has_pick() && least_ == pick_; }

  const Gaps& gaps_;
  Fastest fastest_;
  double least_regret_ = kUnknown;
  bool is_asked_ = true;  // whether the answer may be within this budget and no tighter one
  std::size_t place_ = 0;
  std::size_t pick_ = 0;
  std::size_t least_ = 0;
  std::size_t second_ = 0;
  double second_lower_ = kUnknown;
};

WideGap Gaps::widest() const {
  WideGap widest{.log_gap = -1};
  for (Walk walk(*this); walk.next();) {
    if (walk.log_gap() > widest.log_gap)
      widest = {.log_gap = walk.log_gap(), .pick = walk.pick(), .rival = walk.rival(), .budget = walk.budget()};
  }
  return widest;
}

std::vector<WideGap> Gaps::wider_than(double log_gap, std::size_t most) const {
  std::vector<WideGap> found;
  for (Walk walk(*this); walk.next();) {
    if (!(walk.log_gap() > log_gap)) continue;
    const bool is_same = !found.empty() && found.back().pick == walk.pick() && found.back().rival == walk.rival();
    if (is_same && found.back().log_gap >= walk.log_gap()) continue;
    if (is_same) found.pop_back();
    found.push_back({.log_gap = walk.log_gap(), .pick = walk.pick(), .rival = walk.rival(), .budget = walk.budget()});
  }
  std::ranges::stable_sort(found, std::greater{}, &WideGap::log_gap);
  if (found.size() > most) found.resize(most);
  return found;
}

std::vector<std::size_t> Gaps::next_rivals(const WideGap& gap, double lower, std::size_t most) const {
  std::vector<std::size_t> places;
  for (std::size_t place = 0; place < candidates_.size() && error_[place] <= gap.budget; ++place) {
    const std::size_t candidate = candidates_[place];
    if (lower_[place] < lower && candidate != gap.pick && candidate != gap.rival) places.push_back(place);
  }
  const auto end = places.begin() + static_cast<std::ptrdiff_t>(std::min(most, places.size()));
  std::ranges::partial_sort(places, end, {}, [&](std::size_t place) { return std::pair(lower_[place], place); });
  places.erase(end, places.end());
  for (std::size_t& place : places) place = candidates_[place];
  return places;
}

std::vector<Gaps::Answer> Gaps::answers() const {
  std::vector<Answer> answers;
  for (Walk walk(*this); walk.next();) {
    if (!walk.has_pick() || (regret_ && !walk.is_last())) continue;
    if (answers.empty() || answers.back().pick != walk.pick()) answers.push_back({.pick = walk.pick()});
    answers.back().rival_lower = std::min(answers.back().rival_lower, walk.rival_lower());
    answers.back().log_gap = std::max(answers.back().log_gap, walk.log_gap());
  }
  std::ranges::reverse(answers);
  return answers;
}

}  // namespace reliefbench
