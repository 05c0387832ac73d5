#include "tests/synthetic_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace reliefbench {
namespace {

/// Uniform and normal numbers that do not differ between standard libraries.
class MadeRandom {
 public:
  explicit MadeRandom(std::uint64_t seed) : engine_(seed) {}
  double uniform() { return static_cast<double>(engine_() >> 11U) * 0x1p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  double normal() {
    const double radius = std::sqrt(-2 * std::log(1 - uniform()));
    return radius * std::cos(2 * std::numbers::pi * uniform());
  }

 private:
  std::mt19937_64 engine_;
};

struct MadeTechnique {
  double base_ms;        // of a pixel's setup
  double step_ms;        // of a march step
  double refinement_ms;  // of a refinement step
  double exit_steps;     // after about so many steps most rays have hit
  double error;          // at one step
  double power;          // by which steps reduce the error
  double floor;          // error that no step count removes
};

MadeTechnique technique(MadeRandom& random) {
  return {.base_ms = random.uniform(0.6, 1.6),
          .step_ms = random.uniform(0.05, 0.4),
          .refinement_ms = random.uniform(0.03, 0.12),
          .exit_steps = random.uniform(25, 120),
          .error = random.uniform(0.1, 0.4),
          .power = random.uniform(0.6, 1.1),
          .floor = std::exp(random.uniform(std::log(0.0005), std::log(0.02)))};
}

}  // namespace

RecordedTable synthetic_table(const SyntheticTable& options) {
  MadeRandom random(options.seed);
  RecordedTable table;
  table.backend = "synthetic";
  table.device = "none";
  table.scene = fmt::format("seed {}", options.seed);
  table.error_metric = "error";
  table.space.category_axes = {"technique", "format", "filter"};
  table.space.step_axes = {"march", "refinement"};

  std::vector<double> log_ms;
  for (int t = 0; t < options.techniques; ++t) {
    const MadeTechnique own = technique(random);
    for (int format = 0; format < options.formats; ++format) {
      for (int filter = 0; filter < options.filters; ++filter) {
        const double interaction = options.interaction * random.normal();
        const double phase = random.uniform(0, 2 * std::numbers::pi);
        for (int m = 0; m < options.marches; ++m) {
          for (int r = 0; r < options.refinements; ++r) {
            const double march = std::round(4 * std::pow(256.0 / 4, m / std::max(1.0, options.marches - 1.0)));
            const double refinement = 3.0 * r;
            const double steps = own.exit_steps * (1 - std::exp(-march / own.exit_steps));
            double ms = own.base_ms + own.step_ms * steps + own.refinement_ms * refinement;
            ms *= std::exp(0.006 * format + 0.05 * filter + interaction);
            ms *= std::exp(options.non_monotone * std::sin(1.7 * m + 2.3 * r + phase));
            const double marched = own.error * std::pow(march, -own.power) * std::exp(-0.25 * refinement);
            const double error = marched + own.floor * (1 + 0.4 * (options.formats - 1 - format)) *
                                               (filter == 0 ? 1.3 : 1.0) * std::exp(0.02 * random.normal());
            table.space.candidates.push_back(
                {.id = fmt::format("t{}.f{}.l{}.m{}.r{}", t, format, filter, march, refinement),
                 .categories = {t, format, filter},
                 .steps = {march, refinement},
                 .error = error,
                 .is_feasible = random.uniform() > 0.03});
            log_ms.push_back(std::log(ms));
          }
        }
      }
    }
  }
  const auto [fastest, slowest] = std::ranges::minmax(log_ms);
  for (const double log_time : log_ms) {
    const double rank = slowest > fastest ? (log_time - fastest) / (slowest - fastest) : 0;
    const double noise = options.fast_noise + (options.slow_noise - options.fast_noise) * rank;
    std::vector<double> samples;
    for (int i = 0; i < options.samples; ++i) {
      double sample = log_time + noise * random.normal();
      if (random.uniform() < options.outlier_share) sample += std::log1p(options.outlier_size * random.uniform());
      if (options.fast_share > 0 && table.samples.size() % 4 == 0 && random.uniform() < options.fast_share)
        sample += std::log(0.5);
      samples.push_back(1e6 * std::exp(sample));
    }
    table.samples.push_back(std::move(samples));
  }
  return table;
}

RecordedTable additive_table() {
  return synthetic_table({.seed = 11, .techniques = 6, .formats = 2, .filters = 2, .marches = 6, .refinements = 2});
}

RecordedTable non_additive_table() {
  return synthetic_table({.seed = 12,
                          .techniques = 6,
                          .formats = 2,
                          .filters = 2,
                          .marches = 6,
                          .refinements = 2,
                          .outlier_share = 0.05,
                          .outlier_size = 0.5,
                          .interaction = 0.2,
                          .non_monotone = 0.03});
}

RecordedTable table_with_fast_outliers() {
  return synthetic_table({.seed = 14,
                          .techniques = 6,
                          .formats = 2,
                          .filters = 2,
                          .marches = 6,
                          .refinements = 2,
                          .samples = 20,
                          .fast_share = 0.08});
}

}  // namespace reliefbench
