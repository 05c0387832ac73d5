#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>

namespace reliefbench {

/// The search's hot loops over arrays, compiled for several instruction sets. Lanes are independent and no
/// multiplication is fused with an addition, so that the bits are the same with each.

/// What lies so far apart from each other.
struct Strided {
  const double* first;
  std::ptrdiff_t stride;
};
/// row -= the sum of factor x other row over so many of both.
void subtract_rows(std::span<double> row, const Strided& rows, const Strided& factors, std::size_t count);

/// exp of each, within two units in the last place. values: in [-700, 700]
void exp_of_each(std::span<double> values);

/// What pairs of settings are apart: sums over the axes, one a pair.
struct PairSums {
  Eigen::ArrayXd distance;  ///< squared, weighted
  Eigen::ArrayXd additive;  ///< rational quadratic kernel with all scales, 1 / (1 + distance along the axis)
};
/// A Gaussian process's kernel: Matern 5/2 of the distance, but for a share that is the mean of the additive kernel.
void mixed_kernel(const PairSums& sums, std::size_t axes, double share, Eigen::ArrayXd& kernel);
/// The sums once the weight of an axis is another. squared: unweighted distance along the axis, one a pair
struct WeightMove {
  double before;
  double after;
};
void move_weight(const PairSums& sums, std::span<const double> squared, const WeightMove& weight, PairSums& moved);

/// The sum of term(i) over [0, n), in strands that a processor adds at once.
template <typename Term>
[[nodiscard]] double sum_of(int n, const Term& term) {
  constexpr int kStrands = 4;
  std::array<double, kStrands> sums{};
  int i = 0;
  for (; i + kStrands <= n; i += kStrands)
    for (int strand = 0; strand < kStrands; ++strand) sums[static_cast<std::size_t>(strand)] += term(i + strand);
  for (; i < n; ++i) sums[0] += term(i);
  return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

}  // namespace reliefbench
