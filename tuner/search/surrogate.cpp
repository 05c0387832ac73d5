#include "tuner/search/surrogate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "tuner/search/likelihood.h"
#include "tuner/search/loops.h"

namespace reliefbench {
namespace {

constexpr std::size_t kMostFitted = 96;  // points that hyper-parameters are fitted to
constexpr double kLeastLogWeight = -6;
constexpr double kMostLogWeight = 6;
constexpr double kInactiveStep = 0.25;     // squared distance of a count that one setting has and the other has not
constexpr double kInactiveCategory = 0.3;  // likewise of a choice; two values of one axis: 1
constexpr double kOwnCount = 0.1;          // likewise of two counts as such, whatever lies between them
constexpr double kInactive = -1;           // a category's or a count's value where it is inactive
constexpr int kMostOverhead = 12;          // log2 of the work that a frame's fixed cost may be worth
constexpr double kUnseenChoice = 0.3;      // squared distance that a choice adds while no point has it

/// Between two values of an axis, to be weighted. Where only one is active, other axes say so as well.
double squared_distance(double a, double b, Surrogate::Axis axis) {
  if (a == b) return 0;
  if (axis == Surrogate::Axis::category) return a == kInactive || b == kInactive ? kInactiveCategory : 1;
  if (axis == Surrogate::Axis::count)
    return a == kInactive || b == kInactive ? kInactiveCategory * kOwnCount : kOwnCount;
  const bool is_inactive = axis == Surrogate::Axis::steps && (a == 0 || b == 0);
  return is_inactive ? kInactiveStep : (a - b) * (a - b);
}

}  // namespace

Surrogate::Surrogate(const SearchSpace& space, std::size_t capacity)
    : capacity_(capacity), mean_(Eigen::VectorXd::Zero(std::ssize(space.candidates))) {
  const auto features = [&](auto&& feature) {
    std::vector<double> column;
    for (const Candidate& candidate : space.candidates) column.push_back(feature(candidate));
    return column;
  };
  for (std::size_t i = 0; i < space.step_axes.size(); ++i)
    add_axis(Axis::steps, features([i](const Candidate& candidate) { return std::log1p(candidate.steps[i]); }));
  for (std::size_t i = 0; i < space.work_axes.size(); ++i)
    add_axis(Axis::work, features([i](const Candidate& candidate) { return std::log1p(candidate.work[i]); }));
  for (std::size_t i = 0; i < space.category_axes.size(); ++i)
    add_axis(Axis::category, features([i](const Candidate& candidate) { return candidate.categories[i]; }));
  for (std::size_t i = 0; i < space.step_axes.size(); ++i)
    add_axis(Axis::count, features([i](const Candidate& candidate) {
               return candidate.steps[i] == 0 ? kInactive : candidate.steps[i];
             }));
  for (const Axis kind : {Axis::steps, Axis::category, Axis::count}) {
    std::vector<std::size_t> axes;
    for (std::size_t i = 0; i < axes_.size(); ++i)
      if (axes_[i].axis == kind) axes.push_back(i);
    add_group(std::move(axes));
  }
  for (std::size_t i = 0; i < axes_.size(); ++i)
    if (axes_[i].axis == Axis::work) add_group({i});
  weights_ = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(axes_.size()) + 1);
  for (std::size_t axis = 0; axis < axes_.size(); ++axis)
    if (axes_[axis].axis == Axis::category) weights_[static_cast<Eigen::Index>(axis)] = 0.2;
  const Eigen::Index settings = mean_.size();
  prior_ = Eigen::VectorXd::Zero(settings);
  work_ = prior_;
  if (!space.work_axes.empty())
    for (Eigen::Index i = 0; i < settings; ++i) work_[i] = space.candidates[static_cast<std::size_t>(i)].work.front();
  const auto most = static_cast<Eigen::Index>(capacity);
  values_ = Eigen::VectorXd::Zero(most);
  factor_ = RowMajor::Zero(most, most);
  columns_.resize(most, settings);
  explained_ = Eigen::VectorXd::Zero(settings);
}

void Surrogate::add_axis(Axis axis, std::vector<double> features) {
  if (axis == Axis::steps || axis == Axis::work) {
    const auto [least, most] = std::ranges::minmax(features);
    const double range = most - least;
    if (range > 0)
      for (double& feature : features) feature /= range;
  }
  Levels levels{.axis = axis, .values = features, .unseen = {}, .places = {}};
  std::ranges::sort(levels.values);
  levels.values.erase(std::unique(levels.values.begin(), levels.values.end()), levels.values.end());
  levels.unseen.assign(levels.values.size(), 0);
  for (const double feature : features)
    levels.places.push_back(
        static_cast<std::size_t>(std::ranges::lower_bound(levels.values, feature) - levels.values.begin()));
  axes_.push_back(std::move(levels));
}

void Surrogate::add_group(std::vector<std::size_t> axes) {
  Group group{.axes = std::move(axes), .examples = {}, .places = {}};
  std::map<std::vector<std::size_t>, std::size_t> seen;
  for (std::size_t setting = 0; setting < static_cast<std::size_t>(mean_.size()); ++setting) {
    std::vector<std::size_t> tuple;
    for (const std::size_t axis : group.axes) tuple.push_back(axes_[axis].places[setting]);
    const auto [found, is_new] = seen.try_emplace(std::move(tuple), group.examples.size());
    if (is_new) group.examples.push_back(setting);
    group.places.push_back(found->second);
  }
  groups_.push_back(std::move(group));
}

/// Squared distance along an axis, weighted, between one of its values and each.
Eigen::ArrayXd Surrogate::along(std::size_t axis, std::size_t own) const {
  const Levels& levels = axes_[axis];
  Eigen::ArrayXd along(static_cast<Eigen::Index>(levels.values.size()));
  for (std::size_t level = 0; level < levels.values.size(); ++level)
    along[static_cast<Eigen::Index>(level)] =
        level == own ? 0
                     : weights_[static_cast<Eigen::Index>(axis)] *
                               squared_distance(levels.values[own], levels.values[level], levels.axis) +
                           levels.unseen[own] + levels.unseen[level];
  return along;
}

Eigen::VectorXd Surrogate::correlations(std::size_t candidate) const {
  PairSums sums{.distance = Eigen::ArrayXd::Zero(mean_.size()), .additive = Eigen::ArrayXd::Zero(mean_.size())};
  for (const Group& group : groups_) {
    const auto tuples = static_cast<Eigen::Index>(group.examples.size());
    PairSums part{.distance = Eigen::ArrayXd::Zero(tuples), .additive = Eigen::ArrayXd::Zero(tuples)};
    for (const std::size_t axis : group.axes) {
      const std::vector<std::size_t>& places = axes_[axis].places;
      const Eigen::ArrayXd distance = along(axis, places[candidate]);
      const Eigen::ArrayXd additive = 1 / (1 + distance);
      for (Eigen::Index tuple = 0; tuple < tuples; ++tuple) {
        const auto level = static_cast<Eigen::Index>(places[group.examples[static_cast<std::size_t>(tuple)]]);
        part.distance[tuple] += distance[level];
        part.additive[tuple] += additive[level];
      }
    }
    for (Eigen::Index setting = 0; setting < mean_.size(); ++setting) {
      const auto tuple = static_cast<Eigen::Index>(group.places[static_cast<std::size_t>(setting)]);
      sums.distance[setting] += part.distance[tuple];
      sums.additive[setting] += part.additive[tuple];
    }
  }
  const double odds = weights_[weights_.size() - 1];
  Eigen::ArrayXd kernel(mean_.size());
  mixed_kernel(sums, axes_.size(), odds / (1 + odds), kernel);
  return kernel;
}

void Surrogate::append(std::size_t candidate, double noise_variance) {
  const auto n = static_cast<Eigen::Index>(points_.size());
  const auto at = static_cast<Eigen::Index>(candidate);
  // row of the factor: the columns of this setting, as they stand
  const Eigen::VectorXd row = columns_.col(at).head(n);
  const double rest = variance_ * (1 + kJitter) + noise_variance - row.squaredNorm();
  const double diagonal = std::sqrt(std::max(rest, kJitter * variance_));
  factor_.row(n).head(n) = row.transpose();
  factor_(n, n) = diagonal;
  columns_.row(n) = variance_ * correlations(candidate).transpose();
  subtract_rows({&columns_(n, 0), static_cast<std::size_t>(columns_.cols())},
                {.first = columns_.data(), .stride = columns_.cols()}, {.first = row.data(), .stride = 1},
                static_cast<std::size_t>(n));
  columns_.row(n) /= diagonal;
  explained_ += columns_.row(n).array().square().matrix().transpose();
  points_.push_back(candidate);
  noise_.push_back(noise_variance);
}

void Surrogate::add(std::size_t candidate, double log_time, double noise_variance) {
  append(candidate, noise_variance);
  values_[static_cast<Eigen::Index>(points_.size()) - 1] = log_time;
}

double Surrogate::above_prior(std::size_t point) const {
  return values_[static_cast<Eigen::Index>(point)] - prior_[static_cast<Eigen::Index>(points_[point])];
}

void Surrogate::shrink(std::size_t points) {
  while (points_.size() > points) {
    const auto last = static_cast<Eigen::Index>(points_.size()) - 1;
    explained_ -= columns_.row(last).array().square().matrix().transpose();
    points_.pop_back();
    noise_.pop_back();
  }
}

void Surrogate::update() {
  const auto n = static_cast<Eigen::Index>(points_.size());
  if (n == 0) return;
  const auto centred =
      Eigen::VectorXd::NullaryExpr(n, [&](Eigen::Index i) { return above_prior(static_cast<std::size_t>(i)); });
  const Eigen::VectorXd solved = factor_.topLeftCorner(n, n).triangularView<Eigen::Lower>().solve(centred);
  mean_.noalias() = columns_.topRows(n).transpose() * solved;
  mean_ += prior_;
}

double Surrogate::deviation(std::size_t candidate) const {
  return std::sqrt(std::max(0.0, variance_ - explained_[static_cast<Eigen::Index>(candidate)]));
}

void Surrogate::fit_if_due() {
  if (points_.size() < next_fit_) return;
  next_fit_ = points_.size() * 6 / 5 + 1;
  fit();
}

void Surrogate::fit_prior() {
  double least = std::numeric_limits<double>::infinity();
  for (int power = 0; power <= kMostOverhead; ++power) {
    const Eigen::VectorXd shape = (work_.array() + std::ldexp(1.0, power)).log();
    Eigen::VectorXd above(static_cast<Eigen::Index>(points_.size()));
    for (Eigen::Index i = 0; i < above.size(); ++i)
      above[i] = values_[i] - shape[static_cast<Eigen::Index>(points_[static_cast<std::size_t>(i)])];
    const double squares = (above.array() - above.mean()).square().sum();
    if (squares >= least) continue;
    least = squares;
    prior_ = shape.array() + above.mean();
  }
}

Likelihood::Points Surrogate::pairs_of(std::span<const std::size_t> points) const {
  const auto n = static_cast<Eigen::Index>(points.size());
  Likelihood::Points pairs{.squared = Eigen::ArrayXXd(n * (n - 1) / 2, static_cast<Eigen::Index>(axes_.size())),
                           .values = Eigen::VectorXd(n),
                           .noise = Eigen::VectorXd(n)};
  Eigen::Index pair = 0;
  for (Eigen::Index b = 0; b < n; ++b) {
    const std::size_t point = points[static_cast<std::size_t>(b)];
    pairs.values[b] = above_prior(point);
    // The noise is known; as a share of the variance it takes the last fit's, which changes little.
    pairs.noise[b] = noise_[point] / variance_;
    for (Eigen::Index a = b + 1; a < n; ++a, ++pair) {
      const std::size_t other = points_[points[static_cast<std::size_t>(a)]];
      for (std::size_t i = 0; i < axes_.size(); ++i)
        pairs.squared(pair, static_cast<Eigen::Index>(i)) =
            squared_distance(axes_[i][points_[point]], axes_[i][other], axes_[i].axis);
    }
  }
  return pairs;
}

void Surrogate::fit() {
  const std::size_t n = points_.size();
  if (!std::exchange(has_prior_, true)) fit_prior();
  std::vector<std::size_t> subset;
  const std::size_t most = std::min(n, kMostFitted);
  for (std::size_t i = 0; i < most; ++i) subset.push_back(i * n / most);

  // Coordinate search with halved steps: few dimensions, a smooth likelihood and no need for the last digit.
  Likelihood likelihood(pairs_of(subset), weights_.array().log());
  for (const double step : {2.0, 1.0, 0.5, 0.25}) {
    for (Eigen::Index weight = 0; weight < weights_.size(); ++weight) {
      for (const double sign : {1.0, -1.0}) {
        const double moved = likelihood.log_weights()[weight] + sign * step;
        if (likelihood.improve(weight, std::clamp(moved, kLeastLogWeight, kMostLogWeight))) break;
      }
    }
  }
  weights_ = likelihood.log_weights().array().exp();
  variance_ = likelihood.variance();
  rebuild();
}

void Surrogate::find_unseen() {
  for (Levels& axis : axes_) {
    if (axis.axis != Axis::category) continue;
    for (std::size_t level = 0; level < axis.values.size(); ++level)
      axis.unseen[level] = axis.values[level] == kInactive ? 0 : kUnseenChoice;
    for (const std::size_t point : points_) axis.unseen[axis.places[point]] = 0;
  }
}

void Surrogate::rebuild() {
  find_unseen();
  const std::vector<std::size_t> points = std::exchange(points_, {});
  const std::vector<double> noise = std::exchange(noise_, {});
  explained_.setZero();
  for (std::size_t i = 0; i < points.size(); ++i) append(points[i], noise[i]);
}

}  // namespace reliefbench
