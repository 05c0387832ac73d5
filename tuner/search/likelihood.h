#pragma once
#include <Eigen/Core>
#include <span>

#include "tuner/search/loops.h"

namespace reliefbench {

/// How likely a Gaussian process's weights make its points; see Surrogate for the kernel. One weight is moved at a
/// time, so that each pair of points keeps its distance and its additive kernel along all other axes.
class Likelihood {
 public:
  /// What does not depend on the weights. Pairs of points a > b lie by b, then a.
  struct Points {
    Eigen::ArrayXXd squared;  ///< pairs x axes: unweighted squared distance
    Eigen::VectorXd values;   ///< above the process's mean, one a point
    Eigen::VectorXd noise;    ///< variance, in that of the process
  };
  /// log_weights: one an axis and the log odds of the additive share
  Likelihood(Points points, Eigen::VectorXd log_weights);

  /// Moves one weight where that makes the points more likely; false where it does not.
  bool improve(Eigen::Index weight, double log_weight);
  [[nodiscard]] const Eigen::VectorXd& log_weights() const { return log_weights_; }
  [[nodiscard]] double variance() const { return density_.variance; }  ///< of the process, the most likely one

 private:
  struct Density {
    double log_density;
    double variance;
  };
  /// Up to a constant and without the prior.
  [[nodiscard]] Density density(const PairSums& sums, double log_odds);
  /// With a normal prior on the log weights, which keeps axes that the points say nothing about where they are.
  /// squares: of the log weights
  [[nodiscard]] static double posterior(const Density& density, double squares) {
    return density.log_density - squares / 8;
  }

  [[nodiscard]] std::span<const double> along(Eigen::Index axis) const;  // of the pairs

  Points points_;
  Eigen::VectorXd log_weights_;
  PairSums sums_;
  PairSums moved_;  // the sums after a move that is looked at
  Eigen::ArrayXd kernel_;
  Eigen::MatrixXd matrix_;  // covariance, then its Cholesky factor: the lower triangle; the last row is the values
  Density density_{.log_density = 0, .variance = 1};
  double posterior_ = 0;
};

inline constexpr double kJitter = 1e-6;  ///< share of the process's variance

}  // namespace reliefbench
