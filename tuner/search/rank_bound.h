#pragma once
#include <array>
#include <span>

namespace reliefbench {

/// Bounds from the rank of a value among its like, whatever the tails of their distribution.
///
/// Of k independent values all but fewer than j lie beyond their t-quantile with the probability that a binomial
/// variable of chance t is at least k - j + 1. Where that is alpha, the j-th of the k is no further beyond their centre
/// than that quantile, but for a chance of alpha. So values that are rarely far off, by however much, are outvoted.
///
/// The quantile is that of the values of all settings, and these are not alike: the chance that all of k values are far
/// off is the mean of a setting's own to the power of k. What is assumed is that no setting has more than kProne times
/// the tail of all. The worst case is then that a kProne-th of the settings have all of it, and the bound is solved for
/// that: the tail of these is kProne t, and their share of alpha is all of it.
inline constexpr double kProne = 4;
inline constexpr int kMostRanked = 32;  ///< counts that have a rank of their own; more values are judged as so many

/// j, from 1: a quarter of the values may be off.
[[nodiscard]] constexpr int rank_of(int count) { return 1 + (count - 1) / 4; }

/// t of every count from 1. The chances of the counts add up to less than exp(-log_alpha), so that all hold at once.
[[nodiscard]] std::array<double, kMostRanked> tails_for(double log_alpha);

/// How far from their centre the values lie that have a tail of t beyond them, as far as a sample of them shows.
/// values: the sample, sorted by sort_tail() for such a tail or a longer one; where it is too small to show such a
/// tail, kBeyond times its largest, and kLeastBeyond
[[nodiscard]] double beyond(std::span<const double> values, double tail);
/// Brings the largest values to the front, falling, as far as beyond() asks for them.
void sort_tail(std::span<double> values, double tail);
inline constexpr double kBeyond = 1.5;
inline constexpr double kLeastBeyond = 4;

}  // namespace reliefbench
