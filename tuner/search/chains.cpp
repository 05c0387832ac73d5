#include "tuner/search/chains.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace reliefbench {
namespace {

bool is_smaller(const Candidate& a, const Candidate& b) {
  bool is_less = false;
  for (std::size_t axis = 0; axis < a.steps.size(); ++axis) {
    if (a.steps[axis] > b.steps[axis]) return false;
    if (a.steps[axis] < b.steps[axis]) is_less = true;
  }
  return is_less;
}

}  // namespace

Chains::Chains(const SearchSpace& space) : smaller_(space.candidates.size()), larger_(space.candidates.size()) {
  std::map<std::vector<int>, std::vector<std::size_t>> chains;
  for (std::size_t i = 0; i < space.candidates.size(); ++i) {
    if (space.candidates[i].is_feasible) chains[space.candidates[i].categories].push_back(i);
  }
  for (const auto& [categories, members] : chains) {
    for (const std::size_t a : members) {
      for (const std::size_t b : members) {
        if (!is_smaller(space.candidates[a], space.candidates[b])) continue;
        smaller_[b].push_back(a);
        larger_[a].push_back(b);
      }
    }
  }
}

double estimate_slack(const Chains& chains, std::span<const Observed> observed, std::span<const double> scales) {
  const auto variance = [&](std::size_t i) { return scales[i] * scales[i] / observed[i].count(); };
  std::vector<double> excess;
  for (std::size_t i = 0; i < observed.size(); ++i) {
    if (!observed[i].is_measured()) continue;
    bool has_smaller = false;
    double most = 0;
    for (const std::size_t below : chains.smaller(i)) {
      if (!observed[below].is_measured()) continue;
      has_smaller = true;
      const double error = std::sqrt(variance(i) + variance(below));
      most = std::max(most, observed[below].clipped - observed[i].clipped - error);
    }
    if (has_smaller) excess.push_back(most);
  }
  if (excess.size() < kSlackPairs) return kPriorSlack;
  const auto rank = static_cast<std::size_t>(kSlackQuantile * static_cast<double>(excess.size()));
  const auto at = excess.begin() + static_cast<std::ptrdiff_t>(std::min(rank, excess.size() - 1));
  std::nth_element(excess.begin(), at, excess.end());
  return std::max(*at, kLeastSlack);
}

}  // namespace reliefbench
