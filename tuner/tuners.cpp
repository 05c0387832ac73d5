#include "tuner/tuners.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include "kernels/error.h"
#include "kernels/parallel.h"
#include "tuner/search/strategies.h"
#include "tuner/setting_space.h"
#include "tuner/tune_search.h"

namespace reliefbench {
namespace {

/// A figure over the seeds' checkpoints.
template <typename Value>
Spread spread(std::span<const Checkpoint> seeds, Value Checkpoint::*figure, bool more_is_worse = true) {
  Spread result{.mean = 0, .worst = static_cast<double>(seeds.front().*figure)};
  for (const Checkpoint& seed : seeds) {
    const auto value = static_cast<double>(seed.*figure);
    result.mean += value / static_cast<double>(seeds.size());
    result.worst = more_is_worse ? std::max(result.worst, value) : std::min(result.worst, value);
  }
  return result;
}

TunerPoint point_of(double share, std::span<const Checkpoint> seeds) {
  const auto is_uncovered = [](const Checkpoint& seed) { return std::isinf(seed.worst_regret); };
  return {.share = share,
          .timed = spread(seeds, &Checkpoint::timed),
          .samples = spread(seeds, &Checkpoint::samples),
          .worst_regret = spread(seeds, &Checkpoint::worst_regret),
          .mean_regret = spread(seeds, &Checkpoint::mean_regret),
          .hypervolume = spread(seeds, &Checkpoint::hypervolume, false),
          .false_front = spread(seeds, &Checkpoint::false_front),
          .uncovered = static_cast<int>(std::ranges::count_if(seeds, is_uncovered))};
}

nlohmann::json point_json(const TunerPoint& point) {
  const auto number = [](double value) { return std::isinf(value) ? nlohmann::json(nullptr) : nlohmann::json(value); };
  const auto pair = [&](const Spread& figure) -> nlohmann::json {
    return {{"mean", number(figure.mean)}, {"worst", number(figure.worst)}};
  };
  return {{"share", point.share},
          {"timed", pair(point.timed)},
          {"samples", pair(point.samples)},
          {"worst_regret", pair(point.worst_regret)},
          {"mean_regret", pair(point.mean_regret)},
          {"hypervolume", pair(point.hypervolume)},
          {"false_front", pair(point.false_front)},
          {"uncovered", point.uncovered}};
}

/// What every strategy times first. A recorded candidate is called by its case, a default by its setting.
std::vector<std::size_t> first_of(SearchSpace space) {
  for (Candidate& candidate : space.candidates) candidate.id = setting_id(parse_setting(candidate.id));
  return first_settings(space);
}

}  // namespace

TunerComparison compare_tuners(const RecordedTable& table, const TunersOptions& options) {
  if (options.seeds < 1) fail_input("expected one seed or more, not {}", options.seeds);
  if (options.shares.empty()) fail_input("expected a share of the settings to be timed");
  const Judge judge(table);
  const std::vector<std::size_t> first = first_of(table.space);
  const auto seeds = static_cast<std::size_t>(options.seeds);
  const std::size_t shares = options.shares.size();
  const std::span<const Strategy> all = strategies();

  // One piece of work a strategy, share and seed; [strategy][share][seed]
  std::vector<Checkpoint> checkpoints(all.size() * shares * seeds);
  std::mutex mutex;
  std::size_t done = 0;
  parallel_for(static_cast<int>(checkpoints.size()), options.threads, [&](int index) {
    const auto i = static_cast<std::size_t>(index);
    const StrategyTask task{.seed = i % seeds + 1, .first = first};
    checkpoints[i] =
        evaluate(table, judge, all[i / seeds / shares], task, {&options.shares[i / seeds % shares], 1}).front();
    const std::scoped_lock lock(mutex);
    ++done;
    if (options.on_progress) options.on_progress(static_cast<double>(done) / static_cast<double>(checkpoints.size()));
  });

  TunerComparison result{
      .backend = table.backend,
      .device = table.device,
      .scene = table.scene,
      .error_metric = table.error_metric,
      .constraints = table.constraints,
      .settings = static_cast<int>(table.space.candidates.size()),
      .feasible = static_cast<int>(std::ranges::count_if(table.space.candidates, &Candidate::is_feasible)),
      .on_front = static_cast<int>(judge.front().size()),
      .seeds = options.seeds,
      .lines = {}};
  for (std::size_t s = 0; s < all.size(); ++s) {
    TunerLine line{.strategy = all[s].id, .description = all[s].description, .points = {}};
    for (std::size_t k = 0; k < shares; ++k)
      line.points.push_back(
          point_of(options.shares[k], std::span(checkpoints).subspan((s * shares + k) * seeds, seeds)));
    result.lines.push_back(std::move(line));
  }
  return result;
}

nlohmann::json tuners_json(const TunerComparison& comparison) {
  nlohmann::json lines = nlohmann::json::array();
  for (const TunerLine& line : comparison.lines) {
    nlohmann::json points = nlohmann::json::array();
    for (const TunerPoint& point : line.points) points.push_back(point_json(point));
    lines.push_back({{"strategy", line.strategy}, {"description", line.description}, {"points", std::move(points)}});
  }
  return {{"backend", comparison.backend},
          {"device", comparison.device},
          {"scene", comparison.scene},
          {"error_metric", comparison.error_metric},
          {"constraints", comparison.constraints},
          {"settings", comparison.settings},
          {"feasible", comparison.feasible},
          {"front", comparison.on_front},
          {"seeds", comparison.seeds},
          {"strategies", std::move(lines)}};
}

}  // namespace reliefbench
