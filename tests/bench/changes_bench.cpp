// What a night's check costs: 1,000 series of 400 nights. Bar: 2 s on one core.
#include <benchmark/benchmark.h>

#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "tuner/decide/events.h"
#include "tuner/search/random.h"

namespace reliefbench {
namespace {

constexpr std::size_t kNights = 400;

/// 10 techniques, 5 maps, 5 formats, 4 backends; noise of 2 %. A technique is 5 % slower from night 300 on, if asked.
std::vector<CheckedSeries> fleet(bool has_step) {
  Random random(1);
  const auto normal = [&] {
    const double radius = std::sqrt(-2 * std::log(1 - random.uniform()));
    return radius * std::cos(2 * std::numbers::pi * random.uniform());
  };
  std::vector<CheckedSeries> fleet(1000);
  for (std::size_t i = 0; i < fleet.size(); ++i) {
    const auto digit = [&](std::size_t of, std::size_t base) { return std::to_string(i / of % base); };
    fleet[i].traits.technique = digit(1, 10);
    fleet[i].traits.map = digit(10, 5);
    fleet[i].traits.format = digit(50, 5);
    fleet[i].traits.backend = digit(250, 4);
    for (std::size_t night = 0; night < kNights; ++night) {
      const bool is_slower = has_step && night >= 300 && i % 10 == 3;
      fleet[i].calendar.push_back(night);
      fleet[i].log_values.push_back(16 + 0.02 * normal() + (is_slower ? 0.05 : 0));
      fleet[i].standard_errors.push_back(0.004);
    }
  }
  return fleet;
}

/// The series by themselves.
void changes(benchmark::State& state) {
  const std::vector<CheckedSeries> all = fleet(false);
  for (auto _ : state)
    for (const CheckedSeries& series : all)
      benchmark::DoNotOptimize(find_changes(series.log_values, series.standard_errors, {}).sigma);
}
BENCHMARK(changes)->Unit(benchmark::kMillisecond);

/// With their groups and what they share.
void events(benchmark::State& state) {
  const std::vector<CheckedSeries> all = fleet(state.range(0) != 0);
  std::size_t found = 0;
  for (auto _ : state) found = find_events(all, {}).events.size();
  state.counters["events"] = static_cast<double>(found);
}
BENCHMARK(events)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace reliefbench
