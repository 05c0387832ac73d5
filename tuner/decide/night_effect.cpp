#include "tuner/decide/night_effect.h"

#include <map>
#include <string>
#include <utility>

#include "tuner/decide/level_fit.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

constexpr std::size_t kFewestSeries = 8;  // whose median says what a night was like
constexpr double kLessNoise = 0.9;        // of a series, for the median to be worth its own noise

/// The effect of each night, by the calendar.
using NightEffects = std::map<std::size_t, double>;

NightEffects night_effects(std::span<const CheckedSeries> series, std::span<const std::size_t> members) {
  std::map<std::size_t, std::vector<double>> rests;
  for (const std::size_t i : members) {
    const double level = median(series[i].log_values);
    for (std::size_t night = 0; night < series[i].calendar.size(); ++night)
      rests[series[i].calendar[night]].push_back(series[i].log_values[night] - level);
  }
  NightEffects effects;
  for (const auto& [night, values] : rests)
    if (values.size() >= kFewestSeries) effects[night] = median(values);
  return effects;
}

CheckedSeries without(const CheckedSeries& series, const NightEffects& effects) {
  CheckedSeries rest = series;
  for (std::size_t night = 0; night < rest.calendar.size(); ++night)
    if (const auto found = effects.find(rest.calendar[night]); found != effects.end())
      rest.log_values[night] -= found->second;
  return rest;
}

double usual_noise(std::span<const CheckedSeries> series, std::span<const std::size_t> members) {
  std::vector<double> sigmas;
  for (const std::size_t i : members) sigmas.push_back(difference_sigma(series[i].log_values));
  return median(sigmas);
}

}  // namespace

std::optional<std::vector<CheckedSeries>> without_night_effects(std::span<const CheckedSeries> series) {
  std::map<std::pair<std::string, std::string>, std::vector<std::size_t>> backends;  // machine, backend
  for (std::size_t i = 0; i < series.size(); ++i)
    if (!series[i].traits.is_control && !series[i].calendar.empty())
      backends[{series[i].traits.machine, series[i].traits.backend}].push_back(i);
  std::vector<CheckedSeries> rests(series.begin(), series.end());
  bool is_less = false;
  for (const auto& [name, members] : backends) {
    const NightEffects effects = night_effects(series, members);
    std::vector<CheckedSeries> tried = rests;
    for (const std::size_t i : members) tried[i] = without(series[i], effects);
    if (usual_noise(tried, members) >= kLessNoise * usual_noise(series, members)) continue;
    rests = std::move(tried);
    is_less = true;
  }
  return is_less ? std::optional(std::move(rests)) : std::nullopt;
}

}  // namespace reliefbench
