#include "tests/synthetic_history.h"

#include <fmt/format.h>

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

std::vector<CheckedSeries> synthetic_fleet(const SyntheticFleet& options) {
  Noise noise(options.seed);
  std::vector<std::vector<double>> common(options.machines);  // by machine and night
  for (std::vector<double>& nights : common)
    for (std::size_t night = 0; night < options.nights; ++night)
      nights.push_back(options.common_sigma * noise.normal());
  std::vector<CheckedSeries> fleet;
  const std::size_t cases = options.backends * options.techniques * options.maps * options.formats;
  for (std::size_t i = 0; i < options.machines * cases; ++i) {
    std::size_t digits = i;
    const auto digit = [&](const char* name, std::size_t base) {
      const std::string text = fmt::format("{}{}", name, digits % base);
      digits /= base;
      return text;
    };
    CheckedSeries series;
    series.traits.format = digit("f", options.formats);
    series.traits.map = digit("m", options.maps);
    series.traits.technique = digit("t", options.techniques);
    series.traits.backend = digit("b", options.backends);
    const std::size_t machine = digits;
    series.traits.machine = fmt::format("machine {}", machine);
    const double sigma = options.least_sigma + (options.most_sigma - options.least_sigma) * noise.uniform();
    const double level = 14 + 3 * noise.uniform();
    for (std::size_t night = 0; night < options.nights; ++night) {
      double value = level + common[machine][night] + sigma * noise.normal();
      if (noise.uniform() < options.spike_share) value += 0.1 + 0.2 * noise.uniform();
      series.calendar.push_back(night * options.machines + machine);
      series.log_values.push_back(value);
      series.standard_errors.push_back(0.2 * sigma);
    }
    fleet.push_back(std::move(series));
  }
  return fleet;
}

}  // namespace reliefbench
