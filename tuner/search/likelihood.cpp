#include "tuner/search/likelihood.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace reliefbench {

Likelihood::Likelihood(Points points, Eigen::VectorXd log_weights)
    : points_(std::move(points)),
      log_weights_(std::move(log_weights)),
      distance_(Eigen::ArrayXd::Zero(points_.squared.rows())),
      additive_(distance_),
      matrix_(points_.values.size(), points_.values.size()) {
  for (Eigen::Index axis = 0; axis < points_.squared.cols(); ++axis) {
    const Eigen::ArrayXd along = std::exp(log_weights_[axis]) * points_.squared.col(axis);
    distance_ += along;
    additive_ += rational_quadratic(along);
  }
  density_ = density(distance_, additive_, log_weights_[log_weights_.size() - 1]);
  posterior_ = posterior(density_, log_weights_.squaredNorm());
}

bool Likelihood::improve(Eigen::Index weight, double log_weight) {
  const double squares =
      log_weights_.squaredNorm() - log_weights_[weight] * log_weights_[weight] + log_weight * log_weight;
  // Along an axis on which all points agree, the weight changes the prior alone.
  const bool is_axis = weight < points_.squared.cols();
  if (is_axis && (points_.squared.col(weight) == 0).all()) {
    if (!(posterior(density_, squares) > posterior_)) return false;
    log_weights_[weight] = log_weight;
    posterior_ = posterior(density_, squares);
    return true;
  }
  Eigen::ArrayXd distance = distance_;
  Eigen::ArrayXd additive = additive_;
  double log_odds = log_weights_[log_weights_.size() - 1];
  if (is_axis) {
    const auto squared = points_.squared.col(weight);
    const Eigen::ArrayXd before = std::exp(log_weights_[weight]) * squared;
    const Eigen::ArrayXd after = std::exp(log_weight) * squared;
    distance = (distance + after - before).max(0);
    additive += rational_quadratic(after) - rational_quadratic(before);
  } else {
    log_odds = log_weight;
  }
  const Density moved = density(distance, additive, log_odds);
  if (!(posterior(moved, squares) > posterior_)) return false;
  log_weights_[weight] = log_weight;
  distance_ = std::move(distance);
  additive_ = std::move(additive);
  density_ = moved;
  posterior_ = posterior(moved, squares);
  return true;
}

Likelihood::Density Likelihood::density(const Eigen::ArrayXd& distance, const Eigen::ArrayXd& additive,
                                        double log_odds) {
  const Eigen::Index n = points_.values.size();
  const double odds = std::exp(log_odds);
  const Eigen::ArrayXd kernel = mixed_kernel(odds / (1 + odds), points_.squared.cols(), distance, additive);
  Eigen::Index first = 0;
  for (Eigen::Index b = 0; b < n; ++b) {
    const Eigen::Index below = n - b - 1;
    matrix_.col(b).tail(below) = kernel.segment(first, below).matrix();
    matrix_(b, b) = 1 + kJitter + points_.noise[b];
    first += below;
  }
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>, Eigen::Lower> cholesky(matrix_);  // in place
  const double none = -std::numeric_limits<double>::infinity();
  if (cholesky.info() != Eigen::Success) return {.log_density = none, .variance = density_.variance};
  const double fit = cholesky.matrixL().solve(points_.values).squaredNorm();
  const double variance = std::max(fit / static_cast<double>(n), 1e-8);
  double log_determinant = 0;
  for (Eigen::Index i = 0; i < n; ++i) log_determinant += std::log(matrix_(i, i));
  return {.log_density = -static_cast<double>(n) / 2 * std::log(variance) - log_determinant, .variance = variance};
}

}  // namespace reliefbench
