#include "tuner/search/loops.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

// An instruction set is chosen as the program starts: before ThreadSanitizer has.
#if defined(__x86_64__) && !defined(__SANITIZE_THREAD__)
#define RELIEFBENCH_EACH_TARGET __attribute__((target_clones("default", "avx2")))
#else
#define RELIEFBENCH_EACH_TARGET
#endif

namespace reliefbench {
namespace {

/// source: Moshier, "Methods and Programs for Mathematical Functions", 1989 (Cephes): exp of the rest by a rational
/// function
inline double quick_exp(double x) {
  constexpr double kRounds = 0x1.8p52;  // added, it leaves no bits below one
  const double shifted = x * 1.4426950408889634073599 + kRounds;
  const double power = shifted - kRounds;
  const double rest = x - power * 0.693145751953125 - power * 1.42860682030941723212e-6;
  const double square = rest * rest;
  const double odd =
      ((1.26177193074810590878e-4 * square + 3.02994407707441961300e-2) * square + 9.99999999999999999910e-1) * rest;
  const double even =
      ((3.00198505138664455042e-6 * square + 2.52448340349684104192e-3) * square + 2.27265548208155028766e-1) * square +
      2.00000000000000000009e0;
  const double fraction = 1 + 2 * (odd / (even - odd));
  const auto exponent = std::bit_cast<std::uint64_t>(shifted) << 52U;
  return std::bit_cast<double>(std::bit_cast<std::uint64_t>(fraction) + exponent);
}

RELIEFBENCH_EACH_TARGET void subtract(double* __restrict row, std::size_t n, Strided rows, Strided factors,
                                      std::size_t count) {
  const double* other = rows.first;
  const double* factor = factors.first;
  std::size_t k = 0;
  for (; k + 4 <= count; k += 4, other += 4 * rows.stride, factor += 4 * factors.stride) {
    const double a = factor[0];
    const double b = factor[factors.stride];
    const double c = factor[2 * factors.stride];
    const double d = factor[3 * factors.stride];
    for (std::size_t i = 0; i < n; ++i) {
      const double* const at = other + i;
      row[i] -= (a * at[0] + b * at[rows.stride]) + (c * at[2 * rows.stride] + d * at[3 * rows.stride]);
    }
  }
  for (; k < count; ++k, other += rows.stride, factor += factors.stride)
    for (std::size_t i = 0; i < n; ++i) row[i] -= *factor * other[i];
}

RELIEFBENCH_EACH_TARGET void raise(double* values, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) values[i] = quick_exp(values[i]);
}

constexpr double kFar = 490'000;  // beyond which exp(-r) is nothing

RELIEFBENCH_EACH_TARGET void mix(double matern, double additive_share, const double* __restrict distance,
                                 const double* __restrict additive, double* __restrict kernel, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i) {
    const double squared = 5 * distance[i];
    const double r = std::sqrt(squared < kFar ? squared : kFar);
    kernel[i] = additive_share * additive[i] + matern * (1 + r + r * r * (1.0 / 3)) * quick_exp(-r);
  }
}

RELIEFBENCH_EACH_TARGET void move(WeightMove weight, const double* __restrict squared, std::size_t n,
                                  const double* __restrict from_distance, const double* __restrict from_additive,
                                  double* __restrict distance, double* __restrict additive) {
  for (std::size_t i = 0; i < n; ++i) {
    const double before = weight.before * squared[i];
    const double after = weight.after * squared[i];
    distance[i] = std::max(from_distance[i] + after - before, 0.0);
    additive[i] = from_additive[i] + (before - after) / ((1 + after) * (1 + before));
  }
}

}  // namespace

void subtract_rows(std::span<double> row, const Strided& rows, const Strided& factors, std::size_t count) {
  subtract(row.data(), row.size(), rows, factors, count);
}

void exp_of_each(std::span<double> values) { raise(values.data(), values.size()); }

void mixed_kernel(const PairSums& sums, std::size_t axes, double share, Eigen::ArrayXd& kernel) {
  mix(1 - share, share / static_cast<double>(axes), sums.distance.data(), sums.additive.data(), kernel.data(),
      static_cast<std::size_t>(kernel.size()));
}

void move_weight(const PairSums& sums, std::span<const double> squared, const WeightMove& weight, PairSums& moved) {
  move(weight, squared.data(), squared.size(), sums.distance.data(), sums.additive.data(), moved.distance.data(),
       moved.additive.data());
}

}  // namespace reliefbench
