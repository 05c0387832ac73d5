#include <algorithm>
#include <cmath>
#include <numeric>

#include "tuner/decide/hardware.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

/// Ranks from 0; equal values share their mean rank.
std::vector<double> ranks_of(std::span<const double> values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) { return values[i]; });
  std::vector<double> ranks(values.size());
  for (std::size_t first = 0; first < order.size();) {
    std::size_t last = first;
    while (last + 1 < order.size() && values[order[last + 1]] == values[order[first]]) ++last;
    for (std::size_t k = first; k <= last; ++k) ranks[order[k]] = static_cast<double>(first + last) / 2;
    first = last + 1;
  }
  return ranks;
}

}  // namespace

RankCorrelation rank_correlation(std::span<const double> a, std::span<const double> b, double confidence) {
  RankCorrelation result{.scene = {}, .cases = a.size(), .low = -1, .high = 1};
  const std::vector<double> ranks_a = ranks_of(a);
  const std::vector<double> ranks_b = ranks_of(b);
  const auto n = static_cast<double>(a.size());
  const double mean = (n - 1) / 2;
  double product = 0;
  double square_a = 0;
  double square_b = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    product += (ranks_a[i] - mean) * (ranks_b[i] - mean);
    square_a += (ranks_a[i] - mean) * (ranks_a[i] - mean);
    square_b += (ranks_b[i] - mean) * (ranks_b[i] - mean);
  }
  if (square_a <= 0 || square_b <= 0) return result;
  result.rho = std::clamp(product / std::sqrt(square_a * square_b), -1.0, 1.0);
  if (a.size() < 4) return result;
  const double error = std::sqrt((1 + result.rho * result.rho / 2) / (n - 3));
  const double margin = student_t_quantile(1 - confidence, kMostDf) * error;
  const double z = std::atanh(std::clamp(result.rho, -1 + 1e-12, 1 - 1e-12));
  result.low = std::tanh(z - margin);
  result.high = std::tanh(z + margin);
  return result;
}

}  // namespace reliefbench
