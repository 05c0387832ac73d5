// What a night's check costs: 1,000 series of 400 nights. Bar: 2 s on one core; 10 s where every series moves by
// itself.
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

/// What happens in night 300.
enum class Cause {
  none,
  technique,  ///< one is 5 % slower
  driver,     ///< every series moves by itself, by a size of deviation 5 %
};

/// 10 techniques, 5 maps, 5 formats, 4 backends; noise of 2 %.
std::vector<CheckedSeries> fleet(Cause cause) {
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
    double step = 0;
    if (cause == Cause::technique && i % 10 == 3) step = 0.05;
    if (cause == Cause::driver) step = 0.05 * normal();
    for (std::size_t night = 0; night < kNights; ++night) {
      fleet[i].calendar.push_back(night);
      fleet[i].log_values.push_back(16 + 0.02 * normal() + (night >= 300 ? step : 0));
      fleet[i].standard_errors.push_back(0.004);
    }
  }
  return fleet;
}

/// The series by themselves.
void changes(benchmark::State& state) {
  const std::vector<CheckedSeries> all = fleet(Cause::none);
  for (auto _ : state)
    for (const CheckedSeries& series : all)
      benchmark::DoNotOptimize(find_changes(series.log_values, series.standard_errors, {}).sigma);
}
BENCHMARK(changes)->Unit(benchmark::kMillisecond);

/// With their groups and what they share.
void events(benchmark::State& state) {
  const std::vector<CheckedSeries> all = fleet(static_cast<Cause>(state.range(0)));
  std::size_t found = 0;
  for (auto _ : state) found = find_events(all, {}).events.size();
  state.counters["events"] = static_cast<double>(found);
}
BENCHMARK(events)->DenseRange(0, 2)->ArgName("cause")->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace reliefbench
