#include "tuner/search/likelihood.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "tuner/search/loops.h"

namespace reliefbench {
namespace {

/// Of a symmetric matrix's lower triangle, in place: a right-hand side that is a further row becomes what solves for
/// it. False where the matrix is not positive definite.
bool factorise(Eigen::MatrixXd& matrix) {
  const Eigen::Index rows = matrix.rows();
  for (Eigen::Index column = 0; column < matrix.cols(); ++column) {
    const std::span below(&matrix(column, column), static_cast<std::size_t>(rows - column));
    const Strided row{.first = &matrix(column, 0), .stride = rows};
    subtract_rows(below, row, row, static_cast<std::size_t>(column));
    if (!(below.front() > 0)) return false;
    const double scale = 1 / std::sqrt(below.front());
    for (double& value : below) value *= scale;
  }
  return true;
}

}  // namespace

Likelihood::Likelihood(Points points, Eigen::VectorXd log_weights)
    : points_(std::move(points)),
      log_weights_(std::move(log_weights)),
      sums_{.distance = Eigen::ArrayXd::Zero(points_.squared.rows()),
            .additive = Eigen::ArrayXd::Constant(points_.squared.rows(), static_cast<double>(points_.squared.cols()))},
      moved_(sums_),
      kernel_(points_.squared.rows()),
      matrix_(points_.values.size() + 1, points_.values.size()) {
  for (Eigen::Index axis = 0; axis < points_.squared.cols(); ++axis) {
    move_weight(sums_, along(axis), {.before = 0, .after = std::exp(log_weights_[axis])}, moved_);
    std::swap(sums_, moved_);
  }
  density_ = density(sums_, log_weights_[log_weights_.size() - 1]);
  posterior_ = posterior(density_, log_weights_.squaredNorm());
}

std::span<const double> Likelihood::along(Eigen::Index axis) const {
  return {points_.squared.col(axis).data(), static_cast<std::size_t>(points_.squared.rows())};
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
  const double log_odds = is_axis ? log_weights_[log_weights_.size() - 1] : log_weight;
  if (is_axis)
    move_weight(sums_, along(weight), {.before = std::exp(log_weights_[weight]), .after = std::exp(log_weight)},
                moved_);
  const Density moved = density(is_axis ? moved_ : sums_, log_odds);
  if (!(posterior(moved, squares) > posterior_)) return false;
  log_weights_[weight] = log_weight;
  if (is_axis) std::swap(sums_, moved_);
  density_ = moved;
  posterior_ = posterior(moved, squares);
  return true;
}

Likelihood::Density Likelihood::density(const PairSums& sums, double log_odds) {
  const Eigen::Index n = points_.values.size();
  const double odds = std::exp(log_odds);
  mixed_kernel(sums, static_cast<std::size_t>(points_.squared.cols()), odds / (1 + odds), kernel_);
  Eigen::Index first = 0;
  for (Eigen::Index b = 0; b < n; ++b) {
    const Eigen::Index below = n - b - 1;
    matrix_.col(b).segment(b + 1, below) = kernel_.segment(first, below).matrix();
    matrix_(b, b) = 1 + kJitter + points_.noise[b];
    first += below;
  }
  matrix_.row(n) = points_.values.transpose();
  if (!factorise(matrix_))
    return {.log_density = -std::numeric_limits<double>::infinity(), .variance = density_.variance};
  const double variance = std::max(matrix_.row(n).squaredNorm() / static_cast<double>(n), 1e-8);
  double log_determinant = 0;
  for (Eigen::Index i = 0; i < n; ++i) log_determinant += std::log(matrix_(i, i));
  return {.log_density = -static_cast<double>(n) / 2 * std::log(variance) - log_determinant, .variance = variance};
}

}  // namespace reliefbench
