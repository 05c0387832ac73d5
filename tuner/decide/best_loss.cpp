#include "tuner/decide/best_loss.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

double normal_below(double z) { return std::erfc(-z / std::numbers::sqrt2) / 2; }

/// Standard errors of a group as those of normal variables that have Student's tail where it counts.
struct GroupErrors {
  std::vector<double> errors;  ///< parallel to the group
  std::size_t least = 0;       ///< of the estimates
};

class StudentTails {
 public:
  explicit StudentTails(double p) : p_(p), normal_(student_t_quantile(p, kMostDf)) {}
  [[nodiscard]] double factor(double df) {
    const int whole = std::clamp(static_cast<int>(df), 1, kMostDf);
    const auto [found, is_new] = factors_.try_emplace(whole, 1.0);
    if (is_new && whole < kMostDf) found->second = student_t_quantile(p_, whole) / normal_;
    return found->second;
  }

 private:
  double p_;
  double normal_;
  std::map<int, double> factors_;
};

/// P(|e_i - e_least| <= c times its standard error for all i), by the trapezoidal rule over e_least.
double chance_within(const GroupErrors& group, double c) {
  constexpr int kSteps = 32;
  constexpr double kEnd = 6;
  constexpr double kStep = 2 * kEnd / kSteps;
  const double own = group.errors[group.least];
  double chance = 0;
  for (int k = 0; k <= kSteps; ++k) {
    const double z = -kEnd + k * kStep;
    double inside = std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi) * kStep;
    for (std::size_t i = 0; i < group.errors.size() && inside > 1e-12; ++i) {
      if (i == group.least) continue;
      const double error = group.errors[i];
      const double limit = c * std::hypot(error, own);
      if (error > 0)
        inside *= normal_below((limit + own * z) / error) - normal_below((own * z - limit) / error);
      else if (std::abs(own * z) > limit)
        inside = 0;
    }
    chance += inside;
  }
  return std::min(chance, 1.0);
}

/// The c with which all groups hold at once.
double critical_value(std::span<const GroupErrors> groups, double confidence) {
  const auto chance = [&](double c) {
    double all = 1;
    for (const GroupErrors& group : groups) all *= chance_within(group, c);
    return all;
  };
  double low = 1;
  double high = 8;  // beyond what any count of estimates asks for
  constexpr int kHalvings = 14;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = (low + high) / 2;
    (chance(middle) < confidence ? low : high) = middle;
  }
  return high;
}

/// Whether an estimate may be the least: no other one is below it by more than chance allows.
std::vector<std::size_t> candidates_of(std::span<const Estimate> group, std::span<const double> errors, double c) {
  std::vector<std::size_t> candidates;
  for (std::size_t j = 0; j < group.size(); ++j) {
    bool may_be = true;
    for (std::size_t i = 0; i < group.size() && may_be; ++i)
      may_be = group[j].value - group[i].value <= c * std::hypot(errors[i], errors[j]);
    if (may_be) candidates.push_back(j);
  }
  return candidates;
}

std::vector<LossInterval> losses_of(std::span<const Estimate> group, const GroupErrors& own, double c) {
  const std::vector<std::size_t> candidates = candidates_of(group, own.errors, c);
  std::vector<LossInterval> losses;
  for (std::size_t i = 0; i < group.size(); ++i) {
    const double value = group[i].value - group[own.least].value;
    LossInterval loss{.value = value, .low = value, .high = value};
    for (const std::size_t j : candidates) {
      const double difference = group[i].value - group[j].value;
      const double margin = i == j ? 0 : c * std::hypot(own.errors[i], own.errors[j]);
      loss.low = std::min(loss.low, difference - margin);
      loss.high = std::max(loss.high, difference + margin);
    }
    loss.low = std::max(loss.low, 0.0);
    losses.push_back(loss);
  }
  return losses;
}

}  // namespace

std::vector<std::vector<LossInterval>> losses_to_best(std::span<const std::vector<Estimate>> groups,
                                                      double confidence) {
  std::size_t count = 0;
  for (const auto& group : groups) count += group.size();
  if (count == 0) return std::vector<std::vector<LossInterval>>(groups.size());
  StudentTails tails((1 - confidence) / static_cast<double>(count));
  std::vector<GroupErrors> errors;
  for (const auto& group : groups) {
    GroupErrors& own = errors.emplace_back();
    for (const Estimate& one : group) own.errors.push_back(std::sqrt(one.variance) * tails.factor(one.df));
    own.least = static_cast<std::size_t>(std::ranges::min_element(group, {}, &Estimate::value) - group.begin());
  }
  const auto is_empty = [](const GroupErrors& group) { return group.errors.empty(); };
  std::vector<GroupErrors> filled = errors;
  std::erase_if(filled, is_empty);
  const double c = critical_value(filled, confidence);
  std::vector<std::vector<LossInterval>> losses;
  for (std::size_t g = 0; g < groups.size(); ++g) losses.push_back(losses_of(groups[g], errors[g], c));
  return losses;
}

}  // namespace reliefbench
