#include "tuner/search/surrogate.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

namespace reliefbench {
namespace {

constexpr std::size_t kMostFitted = 96;  // points that hyper-parameters are fitted to
constexpr double kJitter = 1e-6;         // share of the process's variance
constexpr double kLeastLogWeight = -6;
constexpr double kMostLogWeight = 6;
constexpr double kInactiveStep = 0.25;     // squared distance of a count that one setting has and the other has not
constexpr double kInactiveCategory = 0.3;  // likewise of a choice; two values of one axis: 1
constexpr double kInactive = -1;           // a category's value where it is inactive
constexpr int kMostOverhead = 12;          // log2 of the work that a frame's fixed cost may be worth
constexpr double kUnseen = 0.2;            // squared distance that a choice adds while no point has it

double matern52(double squared_distance) {
  const double r = std::sqrt(5 * squared_distance);
  return (1 + r + r * r / 3) * std::exp(-r);
}

/// Between two values of an axis, to be weighted. Where only one is active, other axes say so as well.
double squared_distance(double a, double b, Surrogate::Axis axis) {
  if (a == b) return 0;
  if (axis == Surrogate::Axis::category) return a == kInactive || b == kInactive ? kInactiveCategory : 1;
  const bool is_inactive = axis == Surrogate::Axis::steps && (a == 0 || b == 0);
  return is_inactive ? kInactiveStep : (a - b) * (a - b);
}

double additive_share(const Eigen::VectorXd& weights) {
  const double odds = weights[weights.size() - 1];
  return odds / (1 + odds);
}

}  // namespace

Surrogate::Surrogate(const SearchSpace& space, std::size_t capacity) : capacity_(capacity) {
  axes_.insert(axes_.end(), space.step_axes.size(), Axis::steps);
  axes_.insert(axes_.end(), space.work_axes.size(), Axis::work);
  axes_.insert(axes_.end(), space.category_axes.size(), Axis::category);
  const auto settings = static_cast<Eigen::Index>(space.candidates.size());
  const auto axes = static_cast<Eigen::Index>(axes_.size());
  features_.resize(settings, axes);
  for (Eigen::Index i = 0; i < settings; ++i) {
    const Candidate& candidate = space.candidates[static_cast<std::size_t>(i)];
    Eigen::Index axis = 0;
    for (const double steps : candidate.steps) features_(i, axis++) = std::log1p(steps);
    for (const double work : candidate.work) features_(i, axis++) = std::log1p(work);
    for (const int category : candidate.categories) features_(i, axis++) = category;
  }
  weights_ = Eigen::VectorXd::Ones(axes + 1);
  for (Eigen::Index axis = 0; axis < axes; ++axis) {
    if (axes_[static_cast<std::size_t>(axis)] == Axis::category) {
      weights_[axis] = 0.2;
      continue;
    }
    const double range = features_.col(axis).maxCoeff() - features_.col(axis).minCoeff();
    if (range > 0) features_.col(axis) /= range;
  }
  unseen_ = Eigen::MatrixXd::Zero(settings, axes);
  prior_ = Eigen::VectorXd::Zero(settings);
  work_ = prior_;
  if (!space.work_axes.empty())
    for (Eigen::Index i = 0; i < settings; ++i) work_[i] = space.candidates[static_cast<std::size_t>(i)].work.front();
  const auto most = static_cast<Eigen::Index>(capacity);
  values_ = Eigen::VectorXd::Zero(most);
  factor_ = RowMajor::Zero(most, most);
  columns_.resize(most, settings);
  explained_ = Eigen::VectorXd::Zero(settings);
  mean_ = Eigen::VectorXd::Zero(settings);
}

Eigen::VectorXd Surrogate::correlations(std::size_t candidate) const {
  const auto row = static_cast<Eigen::Index>(candidate);
  Eigen::ArrayXd distance = Eigen::ArrayXd::Zero(features_.rows());
  Eigen::ArrayXd additive = distance;
  for (Eigen::Index axis = 0; axis < features_.cols(); ++axis) {
    const double weight = weights_[axis];
    const double own = features_(row, axis);
    const Axis kind = axes_[static_cast<std::size_t>(axis)];
    const Eigen::ArrayXd along =
        features_.col(axis).array().binaryExpr(unseen_.col(axis).array(), [&](double other, double unseen) {
          return own == other ? 0 : weight * squared_distance(own, other, kind) + unseen_(row, axis) + unseen;
        });
    distance += along;
    additive += 1 / (1 + along);
  }
  const Eigen::ArrayXd r = (5 * distance).sqrt();
  const double share = additive_share(weights_);
  return (share / static_cast<double>(features_.cols()) * additive +
          (1 - share) * (1 + r + r.square() / 3) * (-r).exp())
      .matrix();
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
  Eigen::RowVectorXd column = variance_ * correlations(candidate).transpose();
  if (n > 0) column.noalias() -= row.transpose() * columns_.topRows(n);
  columns_.row(n) = column / diagonal;
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

double Surrogate::log_likelihood(const Eigen::VectorXd& log_weights, std::span<const std::size_t> points,
                                 double& variance) const {
  const auto n = static_cast<Eigen::Index>(points.size());
  const Eigen::VectorXd weights = log_weights.array().exp();
  const double share = additive_share(weights);
  Eigen::MatrixXd matrix(n, n);
  Eigen::VectorXd centred(n);
  for (Eigen::Index a = 0; a < n; ++a) {
    const std::size_t point = points[static_cast<std::size_t>(a)];
    const auto row = static_cast<Eigen::Index>(points_[point]);
    centred[a] = above_prior(point);
    for (Eigen::Index b = 0; b < a; ++b) {
      const auto other = static_cast<Eigen::Index>(points_[points[static_cast<std::size_t>(b)]]);
      double distance = 0;
      double additive = 0;
      for (Eigen::Index axis = 0; axis < features_.cols(); ++axis) {
        const double along = weights[axis] * squared_distance(features_(row, axis), features_(other, axis),
                                                              axes_[static_cast<std::size_t>(axis)]);
        distance += along;
        additive += 1 / (1 + along);
      }
      matrix(a, b) = share / static_cast<double>(features_.cols()) * additive + (1 - share) * matern52(distance);
    }
    // The noise is known; as a share of the variance it takes the last fit's, which changes little.
    matrix(a, a) = 1 + kJitter + noise_[point] / variance_;
  }
  const Eigen::LLT<Eigen::MatrixXd, Eigen::Lower> cholesky(matrix);
  if (cholesky.info() != Eigen::Success) return -std::numeric_limits<double>::infinity();
  const double fit = cholesky.matrixL().solve(centred).squaredNorm();
  variance = std::max(fit / static_cast<double>(n), 1e-8);
  double log_determinant = 0;
  for (Eigen::Index i = 0; i < n; ++i) log_determinant += std::log(cholesky.matrixLLT()(i, i));
  // A normal prior on the log weights keeps axes that the points say nothing about where they are.
  return -static_cast<double>(n) / 2 * std::log(variance) - log_determinant - log_weights.squaredNorm() / 8;
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

void Surrogate::fit() {
  const std::size_t n = points_.size();
  fit_prior();
  std::vector<std::size_t> subset;
  const std::size_t most = std::min(n, kMostFitted);
  for (std::size_t i = 0; i < most; ++i) subset.push_back(i * n / most);

  // Coordinate search with halved steps: few dimensions, a smooth likelihood and no need for the last digit.
  Eigen::VectorXd best = weights_.array().log();
  double variance = variance_;
  double most_likely = log_likelihood(best, subset, variance);
  double best_variance = variance;
  for (const double step : {2.0, 1.0, 0.5, 0.25}) {
    for (Eigen::Index axis = 0; axis < best.size(); ++axis) {
      for (const double sign : {1.0, -1.0}) {
        Eigen::VectorXd trial = best;
        trial[axis] = std::clamp(trial[axis] + sign * step, kLeastLogWeight, kMostLogWeight);
        const double likelihood = log_likelihood(trial, subset, variance);
        if (likelihood <= most_likely) continue;
        most_likely = likelihood;
        best = trial;
        best_variance = variance;
        break;
      }
    }
  }
  weights_ = best.array().exp();
  variance_ = best_variance;
  rebuild();
}

void Surrogate::find_unseen() {
  for (Eigen::Index axis = 0; axis < features_.cols(); ++axis) {
    if (axes_[static_cast<std::size_t>(axis)] != Axis::category) continue;
    std::set<double> seen{kInactive};
    for (const std::size_t point : points_) seen.insert(features_(static_cast<Eigen::Index>(point), axis));
    unseen_.col(axis) = features_.col(axis).unaryExpr([&](double value) { return seen.contains(value) ? 0 : kUnseen; });
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
