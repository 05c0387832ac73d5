#include "tuner/search/surrogate.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
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

double matern52(double squared_distance) {
  const double r = std::sqrt(5 * squared_distance);
  return (1 + r + r * r / 3) * std::exp(-r);
}

/// Between two values of an axis, to be weighted. Where only one is active, other axes say so as well.
double squared_distance(double a, double b, bool is_step) {
  if (a == b) return 0;
  if (is_step) return a == 0 || b == 0 ? kInactiveStep : (a - b) * (a - b);
  return a == kInactive || b == kInactive ? kInactiveCategory : 1;
}

double additive_share(const Eigen::VectorXd& weights) {
  const double odds = weights[weights.size() - 1];
  return odds / (1 + odds);
}

}  // namespace

Surrogate::Surrogate(const SearchSpace& space, std::size_t capacity) : capacity_(capacity) {
  const auto settings = static_cast<Eigen::Index>(space.candidates.size());
  steps_ = static_cast<Eigen::Index>(space.step_axes.size());
  const auto axes = steps_ + static_cast<Eigen::Index>(space.category_axes.size());
  features_.resize(settings, axes);
  for (Eigen::Index i = 0; i < settings; ++i) {
    const Candidate& candidate = space.candidates[static_cast<std::size_t>(i)];
    for (Eigen::Index axis = 0; axis < axes; ++axis) {
      features_(i, axis) = axis < steps_ ? std::log1p(candidate.steps[static_cast<std::size_t>(axis)])
                                         : candidate.categories[static_cast<std::size_t>(axis - steps_)];
    }
  }
  for (Eigen::Index axis = 0; axis < steps_; ++axis) {
    const double range = features_.col(axis).maxCoeff() - features_.col(axis).minCoeff();
    if (range > 0) features_.col(axis) /= range;
  }
  weights_ = Eigen::VectorXd::Ones(axes + 1);
  weights_.segment(steps_, axes - steps_).setConstant(0.2);
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
    const bool is_step = axis < steps_;
    const Eigen::ArrayXd along = features_.col(axis).array().unaryExpr(
        [&](double other) { return weight * squared_distance(own, other, is_step); });
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
  const Eigen::VectorXd centred = values_.head(n).array() - centre_;
  const Eigen::VectorXd solved = factor_.topLeftCorner(n, n).triangularView<Eigen::Lower>().solve(centred);
  mean_.noalias() = columns_.topRows(n).transpose() * solved;
  mean_.array() += centre_;
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
    centred[a] = values_[static_cast<Eigen::Index>(point)] - centre_;
    for (Eigen::Index b = 0; b < a; ++b) {
      const auto other = static_cast<Eigen::Index>(points_[points[static_cast<std::size_t>(b)]]);
      double distance = 0;
      double additive = 0;
      for (Eigen::Index axis = 0; axis < features_.cols(); ++axis) {
        const double along =
            weights[axis] * squared_distance(features_(row, axis), features_(other, axis), axis < steps_);
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

void Surrogate::fit() {
  const std::size_t n = points_.size();
  centre_ = values_.head(static_cast<Eigen::Index>(n)).mean();
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

void Surrogate::rebuild() {
  const std::vector<std::size_t> points = std::exchange(points_, {});
  const std::vector<double> noise = std::exchange(noise_, {});
  explained_.setZero();
  for (std::size_t i = 0; i < points.size(); ++i) append(points[i], noise[i]);
}

}  // namespace reliefbench
