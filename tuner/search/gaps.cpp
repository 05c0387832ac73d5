#include "tuner/search/gaps.h"

#include <algorithm>
#include <tuple>

namespace reliefbench {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::infinity();

}  // namespace

Gaps::Gaps(const SearchSpace& space) : place_(space.candidates.size()) {
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

WidestGap Gaps::widest() const {
  WidestGap widest{.log_gap = -kUnknown};
  std::size_t pick = 0;
  std::size_t rival = 0;
  double least_upper = kUnknown;
  double least_lower = kUnknown;
  for (std::size_t place = 0; place < candidates_.size(); ++place) {
    if (upper_[place] < least_upper) {
      least_upper = upper_[place];
      pick = place;
    }
    if (lower_[place] < least_lower) {
      least_lower = lower_[place];
      rival = place;
    }
    if (ends_budget_[place] == 0 || !(least_upper - least_lower > widest.log_gap)) continue;
    widest = {.log_gap = least_upper - least_lower,
              .pick = candidates_[pick],
              .rival = candidates_[rival],
              .budget = error_[place]};
  }
  return widest;
}

std::vector<Gaps::Answer> Gaps::answers() const {
  std::vector<Answer> answers;
  double least_upper = kUnknown;
  double least_lower = kUnknown;
  std::size_t pick = 0;
  for (std::size_t place = 0; place < candidates_.size(); ++place) {
    least_lower = std::min(least_lower, lower_[place]);
    if (upper_[place] < least_upper) {
      least_upper = upper_[place];
      pick = place;
    }
    if (ends_budget_[place] == 0 || least_upper == kUnknown) continue;
    if (answers.empty() || answers.back().pick != candidates_[pick]) answers.push_back({.pick = candidates_[pick]});
    answers.back().best_lower = least_lower;
  }
  std::ranges::reverse(answers);
  return answers;
}

std::vector<double> Gaps::best_upper() const {
  std::vector<double> best(place_.size(), kUnknown);
  double least = kUnknown;
  for (std::size_t begin = 0; begin < candidates_.size();) {
    std::size_t end = begin;
    do least = std::min(least, upper_[end]);
    while (ends_budget_[end++] == 0);
    for (; begin < end; ++begin) best[candidates_[begin]] = least;
  }
  return best;
}

}  // namespace reliefbench
