#include "tests/synthetic_history.h"

#include <cmath>
#include <numbers>

namespace reliefbench {

double Noise::normal() {
  const double radius = std::sqrt(-2 * std::log(1 - uniform()));
  return radius * std::cos(2 * std::numbers::pi * uniform());
}

double Noise::student3() {
  double square = 0;
  for (int i = 0; i < 3; ++i) {
    const double part = normal();
    square += part * part;
  }
  return normal() / std::sqrt(square);  // a t of 3 has the variance 3
}

std::vector<double> synthetic_history(const SyntheticHistory& options, Noise& noise) {
  std::vector<double> logs;
  const double rho = options.autocorrelation;
  double before = noise.normal();
  for (std::size_t night = 0; night < options.nights; ++night) {
    double value = options.is_heavy_tailed ? noise.student3() : noise.normal();
    if (rho != 0) value = before = rho * before + std::sqrt(1 - rho * rho) * value;
    if (night >= options.step_night) value += options.step;
    value += options.drift * static_cast<double>(night);
    if (options.spike_share > 0 && noise.uniform() < options.spike_share) value += 10 + 20 * noise.uniform();
    logs.push_back(16 + options.sigma * value);
  }
  return logs;
}

}  // namespace reliefbench
