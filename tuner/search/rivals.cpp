#include "tuner/search/rivals.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <set>

#include "kernels/base/error.h"
#include "tuner/search/random.h"

namespace reliefbench {
namespace {

std::vector<std::size_t> shuffled(std::size_t n, Random& random) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < n; ++i) order.push_back(i);
  for (std::size_t i = n; i > 1; --i) std::swap(order[i - 1], order[random.below(i)]);
  return order;
}

double step_distance(const Candidate& a, const Candidate& b) {
  double distance = 0;
  for (std::size_t axis = 0; axis < a.steps.size(); ++axis)
    distance += std::abs(std::log1p(a.steps[axis]) - std::log1p(b.steps[axis]));
  return distance;
}

int category_distance(const Candidate& a, const Candidate& b) {
  int distance = 0;
  for (std::size_t axis = 0; axis < a.categories.size(); ++axis)
    distance += a.categories[axis] != b.categories[axis] ? 1 : 0;
  return distance;
}

/// How often the place on the axis can be halved, the least over the step axes: the first place always can.
int coarseness(const SearchSpace& space, const Candidate& candidate) {
  int least = 30;
  for (std::size_t axis = 0; axis < candidate.steps.size(); ++axis) {
    std::set<double> smaller;
    for (const Candidate& other : space.candidates) {
      if (other.categories == candidate.categories && other.steps[axis] < candidate.steps[axis])
        smaller.insert(other.steps[axis]);
    }
    if (!smaller.empty()) least = std::min(least, std::countr_zero(static_cast<unsigned>(smaller.size())));
  }
  return least;
}

bool time_first(UsualTiming& timing, const StrategyTask& task) {
  for (const std::size_t i : task.first) {
    if (timing.is_open(i) && !timing.measure(i)) return false;
  }
  return true;
}

bool time_random(UsualTiming& timing, std::span<const std::size_t> order) {
  const auto open = std::ranges::find_if(order, [&](std::size_t i) { return timing.is_open(i); });
  return open != order.end() && timing.measure(*open);
}

std::vector<std::size_t> neighbours(const SearchSpace& space, std::size_t at) {
  const Candidate& own = space.candidates[at];
  std::set<std::size_t> found;
  const auto nearest = [&](const auto& is_there) {
    std::size_t best = at;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < space.candidates.size(); ++i) {
      const Candidate& other = space.candidates[i];
      if (!other.is_feasible || !is_there(other)) continue;
      const double distance = 10 * category_distance(own, other) + step_distance(own, other);
      if (distance >= least) continue;
      least = distance;
      best = i;
    }
    if (best != at) found.insert(best);
  };
  for (std::size_t axis = 0; axis < own.steps.size(); ++axis) {
    const auto in_chain = [&](const Candidate& other) { return other.categories == own.categories; };
    nearest([&](const Candidate& other) { return in_chain(other) && other.steps[axis] < own.steps[axis]; });
    nearest([&](const Candidate& other) { return in_chain(other) && other.steps[axis] > own.steps[axis]; });
  }
  for (std::size_t axis = 0; axis < own.categories.size(); ++axis) {
    std::set<int> values;
    for (const Candidate& other : space.candidates) values.insert(other.categories[axis]);
    values.erase(own.categories[axis]);
    for (const int value : values) nearest([&](const Candidate& other) { return other.categories[axis] == value; });
  }
  return {found.begin(), found.end()};
}

}  // namespace

UsualTiming::UsualTiming(const SearchSpace& space, TimeSource& times, const StrategyTask& task)
    : space_(space),
      times_(times),
      most_(static_cast<std::size_t>(std::ranges::count_if(space.candidates, &Candidate::is_feasible))),
      log_time_(space.candidates.size(), std::numeric_limits<double>::quiet_NaN()) {
  if (task.max_timed > 0) most_ = std::min(most_, static_cast<std::size_t>(task.max_timed));
}

bool UsualTiming::is_done() const { return timed_.size() >= most_; }

bool UsualTiming::is_open(std::size_t candidate) const {
  return space_.candidates[candidate].is_feasible && std::isnan(log_time_[candidate]);
}

bool UsualTiming::measure(std::size_t candidate) {
  if (is_done()) return false;
  std::array<double, kUsualFrames> frames{};
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames[i] = times_.frame_ns(candidate, static_cast<int>(i));
    if (!(frames[i] > 0) || std::isinf(frames[i]))
      fail_input("sample {} of setting {} took {} ns: not a time", i, candidate, frames[i]);
  }
  std::ranges::sort(frames);
  log_time_[candidate] = std::log(frames[kUsualFrames / 2]);
  timed_.push_back(candidate);
  return true;
}

StrategyAnswer UsualTiming::answer() const {
  StrategyAnswer answer{.picks = {},
                        .timed = static_cast<int>(timed_.size()),
                        .samples = static_cast<std::int64_t>(timed_.size()) * kUsualFrames};
  std::vector<std::size_t> order = timed_;
  std::ranges::sort(order, [&](std::size_t a, std::size_t b) {
    const double error_a = space_.candidates[a].error;
    const double error_b = space_.candidates[b].error;
    if (error_a != error_b) return error_a < error_b;
    return log_time_[a] != log_time_[b] ? log_time_[a] < log_time_[b] : a < b;
  });
  for (const std::size_t i : order) {
    if (answer.picks.empty() || log_time_[i] < log_time_[answer.picks.back()]) answer.picks.push_back(i);
  }
  std::ranges::reverse(answer.picks);
  return answer;
}

StrategyAnswer random_search(const SearchSpace& space, TimeSource& times, const StrategyTask& task) {
  UsualTiming timing(space, times, task);
  Random random(task.seed);
  bool goes_on = time_first(timing, task);
  for (const std::size_t i : shuffled(space.candidates.size(), random)) {
    if (goes_on && timing.is_open(i)) goes_on = timing.measure(i);
  }
  return timing.answer();
}

StrategyAnswer grid_search(const SearchSpace& space, TimeSource& times, const StrategyTask& task) {
  UsualTiming timing(space, times, task);
  Random random(task.seed);
  std::vector<int> level;
  for (const Candidate& candidate : space.candidates) level.push_back(coarseness(space, candidate));
  std::vector<std::size_t> order = shuffled(space.candidates.size(), random);
  std::ranges::stable_sort(order, std::greater{}, [&](std::size_t i) { return level[i]; });
  bool goes_on = time_first(timing, task);
  for (const std::size_t i : order) {
    if (goes_on && timing.is_open(i)) goes_on = timing.measure(i);
  }
  return timing.answer();
}

StrategyAnswer local_search(const SearchSpace& space, TimeSource& times, const StrategyTask& task) {
  UsualTiming timing(space, times, task);
  Random random(task.seed);
  const std::vector<std::size_t> order = shuffled(space.candidates.size(), random);
  bool goes_on = time_first(timing, task);
  if (goes_on && timing.timed().empty()) goes_on = time_random(timing, order);
  std::vector<char> is_visited(space.candidates.size(), 0);
  while (goes_on && !timing.is_done()) {
    std::vector<std::size_t> unvisited = timing.answer().picks;
    std::erase_if(unvisited, [&](std::size_t i) { return is_visited[i] != 0; });
    if (unvisited.empty()) {
      goes_on = time_random(timing, order);
      continue;
    }
    const std::size_t at = unvisited[random.below(unvisited.size())];
    is_visited[at] = 1;
    for (const std::size_t i : neighbours(space, at)) {
      if (goes_on && timing.is_open(i)) goes_on = timing.measure(i);
    }
  }
  return timing.answer();
}

}  // namespace reliefbench
