#pragma once
#include <Eigen/Core>

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
  /// Up to a constant and without the prior. distance, additive: of the pairs, sums over the axes
  [[nodiscard]] Density density(const Eigen::ArrayXd& distance, const Eigen::ArrayXd& additive, double log_odds);
  /// With a normal prior on the log weights, which keeps axes that the points say nothing about where they are.
  /// squares: of the log weights
  [[nodiscard]] static double posterior(const Density& density, double squares) {
    return density.log_density - squares / 8;
  }

  Points points_;
  Eigen::VectorXd log_weights_;
  Eigen::ArrayXd distance_;
  Eigen::ArrayXd additive_;
  Eigen::MatrixXd matrix_;  // lower triangle, reused
  Density density_{.log_density = 0, .variance = 1};
  double posterior_ = 0;
};

/// Along one axis; the rational quadratic kernel with all scales, so that no distance is without influence.
template <typename Squared>
[[nodiscard]] auto rational_quadratic(const Squared& weighted) {
  return 1 / (1 + weighted);
}
/// share: of the additive kernel, of which `additive` is the sum over `axes`
template <typename Distance, typename Additive>
[[nodiscard]] Eigen::ArrayXd mixed_kernel(double share, Eigen::Index axes, const Distance& distance,
                                          const Additive& additive) {
  const Eigen::ArrayXd r = (5 * distance).sqrt();
  return share / static_cast<double>(axes) * additive + (1 - share) * (1 + r + r.square() / 3) * (-r).exp();
}

inline constexpr double kJitter = 1e-6;  ///< share of the process's variance

}  // namespace reliefbench
