#include "tuner/search/correlation.h"

#include <algorithm>
#include <cmath>

namespace reliefbench {

void BlockCorrelation::add(const Observed& observed, double scale) {
  if (observed.count() < 2) return;
  const double middle = observed.frames[observed.frames.size() / 2];
  std::vector<double> sums(observed.medians.size());
  double total = 0;
  double squares = 0;
  for (std::size_t i = 0; i < observed.frames.size(); ++i) {
    const double deviation = std::clamp((observed.frames[i] - middle) / scale, -kWinsor, kWinsor);
    sums[observed.blocks[i]] += deviation;
    total += deviation;
    squares += deviation * deviation;
  }
  double blocks = 0;
  for (const double sum : sums) blocks += sum * sum / kBlock;
  between_ += blocks - total * total / static_cast<double>(observed.frames.size());
  between_degrees_ += observed.count() - 1;
  within_ += squares - blocks;
  within_degrees_ += (kBlock - 1) * observed.count();
}

double BlockCorrelation::upper_estimate() const {
  if (between_degrees_ == 0) return 1;
  if (!(within_ > 0)) return between_ > 0 ? 1 : 0;
  const double ratio = (between_ / between_degrees_) / (within_ / within_degrees_);
  const double estimate = (ratio - 1) / (ratio + kBlock - 1);
  const double error =
      (1 - estimate) * (1 + (kBlock - 1) * estimate) * std::sqrt(2 / (kBlock * (kBlock - 1) * between_degrees_));
  return std::clamp(estimate + kSurely * error, 0.0, 1.0);
}

}  // namespace reliefbench
