#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "tuner/search/random.h"
#include "tuner/search/rivals.h"

namespace reliefbench {
namespace {

constexpr std::size_t kPopulation = 24;

class Population {
 public:
  Population(const SearchSpace& space, UsualTiming& timing, std::uint64_t seed)
      : space_(space), timing_(timing), random_(seed), ranges_(space.step_axes.size(), 0) {
    for (const Candidate& candidate : space.candidates) {
      for (std::size_t axis = 0; axis < ranges_.size(); ++axis)
        ranges_[axis] = std::max(ranges_[axis], std::log1p(candidate.steps[axis]));
    }
  }

  void evolve() {
    members_ = timing_.timed();
    while (members_.size() < kPopulation && time(random_open())) {
    }
    while (!timing_.is_done()) {
      const std::vector<Ranked> ranked = rank();
      const std::size_t parents = members_.size();
      for (std::size_t child = 0; child < kPopulation; ++child) {
        const Candidate& a = space_.candidates[members_[tournament(ranked, parents)]];
        const Candidate& b = space_.candidates[members_[tournament(ranked, parents)]];
        if (!time(nearest_open(offspring(a, b)))) break;
      }
      select();
    }
  }

 private:
  bool time(std::size_t candidate) {
    if (candidate >= space_.candidates.size() || !timing_.measure(candidate)) return false;
    members_.push_back(candidate);
    return true;
  }

  [[nodiscard]] std::size_t random_open() {
    std::vector<std::size_t> open;
    for (std::size_t i = 0; i < space_.candidates.size(); ++i) {
      if (timing_.is_open(i)) open.push_back(i);
    }
    return open.empty() ? space_.candidates.size() : open[random_.below(open.size())];
  }

  [[nodiscard]] std::vector<Ranked> rank() const {
    std::vector<double> error;
    std::vector<double> time;
    for (const std::size_t i : members_) {
      error.push_back(space_.candidates[i].error);
      time.push_back(timing_.log_time(i));
    }
    return non_dominated_sort(error, time);
  }

  static bool is_better(const Ranked& a, const Ranked& b) {
    return a.front != b.front ? a.front < b.front : a.crowding > b.crowding;
  }

  [[nodiscard]] std::size_t tournament(std::span<const Ranked> ranked, std::size_t parents) {
    const std::size_t a = random_.below(parents);
    const std::size_t b = random_.below(parents);
    return is_better(ranked[a], ranked[b]) ? a : b;
  }

  /// Uniform crossover; then each axis moves with probability 1 / axes: a category to that of a random setting, a step
  /// count by up to a quarter of its range.
  [[nodiscard]] Candidate offspring(const Candidate& a, const Candidate& b) {
    Candidate child = random_.below(2) == 0 ? a : b;
    const std::uint64_t axes = child.categories.size() + child.steps.size();
    for (std::size_t axis = 0; axis < child.categories.size(); ++axis) {
      child.categories[axis] = random_.below(2) == 0 ? a.categories[axis] : b.categories[axis];
      if (random_.below(axes) == 0)
        child.categories[axis] = space_.candidates[random_.below(space_.candidates.size())].categories[axis];
    }
    for (std::size_t axis = 0; axis < child.steps.size(); ++axis) {
      child.steps[axis] = random_.below(2) == 0 ? a.steps[axis] : b.steps[axis];
      if (random_.below(axes) != 0) continue;
      const double move = (random_.uniform() - 0.5) / 2 * ranges_[axis];
      child.steps[axis] = std::max(0.0, std::expm1(std::log1p(child.steps[axis]) + move));
    }
    return child;
  }

  [[nodiscard]] std::size_t nearest_open(const Candidate& wanted) {
    std::size_t best = space_.candidates.size();
    double least = std::numeric_limits<double>::infinity();
    const std::size_t start = random_.below(space_.candidates.size());  // breaks ties
    for (std::size_t step = 0; step < space_.candidates.size(); ++step) {
      const std::size_t i = (start + step) % space_.candidates.size();
      if (!timing_.is_open(i)) continue;
      const Candidate& candidate = space_.candidates[i];
      double distance = 0;
      for (std::size_t axis = 0; axis < wanted.categories.size(); ++axis)
        distance += candidate.categories[axis] != wanted.categories[axis] ? 1 : 0;
      for (std::size_t axis = 0; axis < wanted.steps.size(); ++axis) {
        const double move = std::log1p(candidate.steps[axis]) - std::log1p(wanted.steps[axis]);
        if (ranges_[axis] > 0) distance += std::abs(move) / ranges_[axis];
      }
      if (distance >= least) continue;
      least = distance;
      best = i;
    }
    return best;
  }

  void select() {
    const std::vector<Ranked> ranked = rank();
    std::vector<std::size_t> order(members_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return is_better(ranked[a], ranked[b]); });
    order.resize(std::min(order.size(), kPopulation));
    std::vector<std::size_t> chosen;
    chosen.reserve(order.size());
    for (const std::size_t place : order) chosen.push_back(members_[place]);
    members_ = std::move(chosen);
  }

  const SearchSpace& space_;
  UsualTiming& timing_;
  Random random_;
  std::vector<double> ranges_;
  std::vector<std::size_t> members_;
};

}  // namespace

std::vector<Ranked> non_dominated_sort(std::span<const double> error, std::span<const double> time) {
  const std::size_t n = error.size();
  std::vector<Ranked> ranked(n, Ranked{.front = -1});
  std::vector<std::size_t> left(n);
  std::iota(left.begin(), left.end(), std::size_t{0});
  // With two objectives a front is a staircase: sorted by error, whatever is faster than all before belongs to it.
  std::ranges::sort(left, [&](std::size_t a, std::size_t b) {
    if (error[a] != error[b]) return error[a] < error[b];
    return time[a] != time[b] ? time[a] < time[b] : a < b;
  });
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (int front = 0; !left.empty(); ++front) {
    std::vector<std::size_t> members;
    for (const std::size_t i : left) {
      const bool is_twin = !members.empty() && error[i] == error[members.back()] && time[i] == time[members.back()];
      if (members.empty() || time[i] < time[members.back()] || is_twin) members.push_back(i);
    }
    for (const std::size_t i : members) ranked[i].front = front;
    std::erase_if(left, [&](std::size_t i) { return ranked[i].front == front; });
    const double errors = error[members.back()] - error[members.front()];
    const double times = time[members.front()] - time[members.back()];
    for (std::size_t k = 0; k < members.size(); ++k) {
      double& crowding = ranked[members[k]].crowding;
      if (k == 0 || k + 1 == members.size()) {
        crowding = kInfinity;
        continue;
      }
      if (errors > 0) crowding += (error[members[k + 1]] - error[members[k - 1]]) / errors;
      if (times > 0) crowding += (time[members[k - 1]] - time[members[k + 1]]) / times;
    }
  }
  return ranked;
}

StrategyAnswer nsga2_search(const SearchSpace& space, TimeSource& times, const StrategyTask& task) {
  UsualTiming timing(space, times, task);
  for (const std::size_t i : task.first) {
    if (timing.is_open(i)) timing.measure(i);
  }
  Population(space, timing, task.seed).evolve();
  return timing.answer();
}

}  // namespace reliefbench
