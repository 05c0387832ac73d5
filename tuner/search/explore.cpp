#include "tuner/search/explore.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "tuner/search/improvement.h"

namespace reliefbench {
namespace {

std::vector<std::size_t> feasible_of(const SearchSpace& space) {
  std::vector<std::size_t> feasible;
  for (std::size_t i = 0; i < space.candidates.size(); ++i) {
    if (space.candidates[i].is_feasible) feasible.push_back(i);
  }
  return feasible;
}

SearchSpace part_of(const SearchSpace& space, const std::vector<std::size_t>& candidates) {
  SearchSpace part{.category_axes = space.category_axes,
                   .step_axes = space.step_axes,
                   .work_axes = space.work_axes,
                   .candidates = {}};
  for (const std::size_t i : candidates) part.candidates.push_back(space.candidates[i]);
  return part;
}

std::size_t capacity_for(std::size_t feasible, std::size_t settings) {
  const auto share = static_cast<std::size_t>(static_cast<double>(settings) * Explorer::kShare);
  return std::min({feasible, std::max(share, Explorer::kLeast), Explorer::kMost});
}

/// What is known, or believed, of the fastest setting and of the least regret.
class RegretFront {
 public:
  explicit RegretFront(const RegretRule& rule) : rule_(rule) {}

  void add(double error, double log_time) {
    points_.push_back({error, log_time});
    if (log_time < fastest_) {
      fastest_ = log_time;
      least_ = kNone;
      for (const auto& [other, time] : points_) least_ = std::min(least_, regret(other, time));
    }
    least_ = std::min(least_, regret(error, log_time));
  }

  /// Of a setting with a normal log time: how much it is expected to take off the one or the other, as a log.
  [[nodiscard]] double expected_gain(double error, double mean, double deviation) const {
    const double as_fastest = expected_improvement(fastest_, mean, deviation);
    const double ratio = rule_.most_ratio(error, least_);
    if (!(ratio > 1) || std::isinf(least_)) return as_fastest;
    const double most = std::log1p(least_) - std::log1p(rule_.regret(error, 1));
    return std::max(as_fastest, std::min(most, expected_improvement(fastest_ + std::log(ratio), mean, deviation)));
  }

 private:
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  [[nodiscard]] double regret(double error, double log_time) const {
    return rule_.regret(error, std::exp(log_time - fastest_));
  }

  const RegretRule& rule_;
  std::vector<std::pair<double, double>> points_;  // error, log time
  double fastest_ = kNone;
  double least_ = kNone;
};

}  // namespace

Explorer::Explorer(const SearchSpace& space, const std::optional<RegretRule>& regret)
    : regret_(regret),
      feasible_(feasible_of(space)),
      place_(space.candidates.size(), 0),
      rank_(space.candidates.size(), 0),
      surrogate_(part_of(space, feasible_), capacity_for(feasible_.size(), space.candidates.size()) + kBatch),
      is_learned_(space.candidates.size(), 0) {
  for (const std::size_t i : feasible_) errors_.push_back(space.candidates[i].error);
  const std::vector<std::size_t> ranks = error_ranks(errors_);
  for (std::size_t i = 0; i < feasible_.size(); ++i) {
    place_[feasible_[i]] = i;
    rank_[feasible_[i]] = ranks[i];
  }
  ranks_ = ranks.empty() ? 0 : std::ranges::max(ranks) + 1;
}

void Explorer::learn(std::span<const Observed> observed, std::span<const double> scales) {
  std::vector<std::size_t> fresh;
  for (const std::size_t i : feasible_) {
    if (observed[i].is_measured() && is_learned_[i] == 0) fresh.push_back(i);
  }
  std::ranges::sort(fresh, {}, [&](std::size_t i) { return observed[i].order; });
  for (const std::size_t i : fresh) {
    if (learned_.size() + kBatch >= capacity()) break;
    surrogate_.add(place_[i], observed[i].clipped, scales[i] * scales[i] / observed[i].count());
    learned_.push_back(i);
    is_learned_[i] = 1;
  }
  for (std::size_t point = 0; point < learned_.size(); ++point)
    surrogate_.set(point, observed[learned_[point]].clipped);
  surrogate_.fit_if_due();
  surrogate_.update();
}

std::vector<std::size_t> Explorer::propose(std::span<const Observed> observed, std::span<const double> scales) {
  learn(observed, scales);
  const std::size_t known = learned_.size();
  if (known + kBatch >= capacity()) return {};

  double slowest = -std::numeric_limits<double>::infinity();
  std::vector<std::size_t> left;
  for (const std::size_t i : feasible_) {
    if (observed[i].is_measured())
      slowest = std::max(slowest, observed[i].clipped);
    else
      left.push_back(i);
  }
  Staircase front(ranks_, slowest);
  std::optional<RegretFront> asked;
  if (regret_) asked.emplace(*regret_);
  const auto add = [&](std::size_t i, double log_time) {
    front.add(rank_[i], log_time);
    if (asked) asked->add(errors_[place_[i]], log_time);
  };
  for (const std::size_t i : feasible_)
    if (observed[i].is_measured()) add(i, observed[i].clipped);
  const bool is_rough = static_cast<double>(known) >= kRough * static_cast<double>(rank_.size());
  const bool by_volume = !is_rough || batches_++ % kVolumeEvery == 0;

  std::vector<std::size_t> batch;
  while (batch.size() < kBatch && !left.empty()) {
    std::size_t best = 0;
    double most = -1;
    for (std::size_t place = 0; place < left.size(); ++place) {
      const std::size_t i = left[place];
      const double mean = surrogate_.mean(place_[i]);
      const double deviation = surrogate_.deviation(place_[i]);
      const double limit = asked       ? std::numeric_limits<double>::infinity()
                           : by_volume ? front.most_growth(rank_[i], mean, deviation)
                                       : most_improvement(front.best(rank_[i]), mean, deviation);
      if (limit <= most) continue;
      const double gain = asked       ? asked->expected_gain(errors_[place_[i]], mean, deviation)
                          : by_volume ? front.expected_growth(rank_[i], mean, deviation)
                                      : expected_improvement(front.best(rank_[i]), mean, deviation);
      if (gain <= most) continue;
      most = gain;
      best = place;
    }
    const std::size_t chosen = left[best];
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(best));
    batch.push_back(chosen);
    const double believed = surrogate_.mean(place_[chosen]);
    add(chosen, believed);
    surrogate_.add(place_[chosen], believed, scales[chosen] * scales[chosen]);
    surrogate_.update();
  }
  surrogate_.shrink(known);
  surrogate_.update();
  return batch;
}

}  // namespace reliefbench
