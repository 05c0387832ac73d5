#include "tuner/tune/tuners.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <mutex>
#include <numeric>
#include <utility>

#include "kernels/base/error.h"
#include "kernels/base/parallel.h"
#include "tuner/plan/setting_space.h"
#include "tuner/search/search.h"
#include "tuner/search/strategies.h"
#include "tuner/tune/tune_search.h"

namespace reliefbench {
namespace {

/// A figure over the seeds.
Spread spread_of(std::vector<double> seeds, bool more_is_worse) {
  std::ranges::sort(seeds, [&](double a, double b) { return more_is_worse ? a < b : a > b; });
  const auto count = static_cast<double>(seeds.size());
  return {.mean = std::accumulate(seeds.begin(), seeds.end(), 0.0) / count,
          .most = seeds[static_cast<std::size_t>(std::ceil(kMostSeeds * count)) - 1],
          .worst = seeds.back()};
}

template <typename Seed, typename Value>
Spread spread(std::span<const Seed> seeds, Value Seed::*figure, bool more_is_worse = true) {
  std::vector<double> values;
  values.reserve(seeds.size());
  for (const Seed& seed : seeds) values.push_back(static_cast<double>(seed.*figure));
  return spread_of(std::move(values), more_is_worse);
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

nlohmann::json spread_json(const Spread& figure) {
  const auto number = [](double value) { return std::isinf(value) ? nlohmann::json(nullptr) : nlohmann::json(value); };
  return {{"mean", number(figure.mean)}, {"most", number(figure.most)}, {"worst", number(figure.worst)}};
}

nlohmann::json point_json(const TunerPoint& point) {
  return {{"share", point.share},
          {"timed", spread_json(point.timed)},
          {"samples", spread_json(point.samples)},
          {"worst_regret", spread_json(point.worst_regret)},
          {"mean_regret", spread_json(point.mean_regret)},
          {"hypervolume", spread_json(point.hypervolume)},
          {"false_front", spread_json(point.false_front)},
          {"uncovered", point.uncovered}};
}

/// What every strategy times first. A recorded candidate is called by its case, a default by its setting.
std::vector<std::size_t> first_of(SearchSpace space) {
  for (Candidate& candidate : space.candidates) candidate.id = setting_id(parse_setting(candidate.id));
  return first_settings(space);
}

/// What a seed searches: the table, or a part of it.
struct SeedTable {
  SeedTable(const RecordedTable& all, double part, std::uint64_t seed)
      : table(random_part(all, part, seed)), judge(table), first(first_of(table.space)) {}

  RecordedTable table;
  Judge judge;
  std::vector<std::size_t> first;
};

/// How one seed's search ended.
struct Ending {
  bool is_certified = false;
  bool is_bounded = true;
  double frames_per_setting = 0;
  double worst_regret = 0;
};

Ending ending_of(const SeedTable& given, const SearchOptions& options, TimeSource& times) {
  const RecordedTable& table = given.table;
  const SearchResult found = search(table.space, times, options);
  std::vector<std::size_t> picks;
  for (const BudgetAnswer& answer : found.answers) picks.push_back(answer.pick);
  Ending ending{.is_certified = found.is_certified,
                .frames_per_setting = static_cast<double>(found.samples) / static_cast<double>(table.samples.size()),
                .worst_regret = given.judge.judge(picks).worst_regret};
  for (std::size_t i = 0; i < found.states.size(); ++i) {
    const CandidateState& state = found.states[i];
    if (state.evidence == Evidence::measured && state.low_ns)
      ending.is_bounded &= std::log(*state.low_ns) <= given.judge.true_log_times()[i] + std::log1p(options.epsilon / 2);
  }
  return ending;
}

nlohmann::json certificate_json(const CertificateCheck& check) {
  return {{"epsilon", check.epsilon},
          {"confidence", check.confidence},
          {"seeds", check.seeds},
          {"certified", check.certified},
          {"held", check.held},
          {"bounded", check.bounded},
          {"frames_per_setting", spread_json(check.frames_per_setting)},
          {"worst_regret", spread_json(check.worst_regret)}};
}

}  // namespace

CertificateCheck check_certificate(
    const RecordedTable& table, const CertificateOptions& options,
    const std::function<std::unique_ptr<TimeSource>(const RecordedTable& table, std::uint64_t seed)>& replay) {
  const SearchOptions usual;
  CertificateCheck check{.epsilon = usual.epsilon, .confidence = usual.confidence, .seeds = options.seeds};
  if (options.seeds == 0) return check;
  std::vector<Ending> endings(static_cast<std::size_t>(options.seeds));
  parallel_for(options.seeds, options.threads, [&](int index) {
    const std::uint64_t seed = static_cast<std::uint64_t>(index) + 1;
    const SeedTable given(table, options.part, seed);
    const SearchOptions asked{
        .seed = seed, .first = given.first, .max_samples = kPatience * std::ssize(given.table.samples)};
    endings[static_cast<std::size_t>(index)] = ending_of(given, asked, *replay(given.table, seed));
    if (options.on_done) options.on_done();
  });
  for (const Ending& ending : endings) {
    check.certified += ending.is_certified ? 1 : 0;
    check.held += ending.is_certified && ending.worst_regret <= check.epsilon ? 1 : 0;
    check.bounded += ending.is_bounded ? 1 : 0;
  }
  const std::span<const Ending> all = endings;
  check.frames_per_setting = spread(all, &Ending::frames_per_setting);
  check.worst_regret = spread(all, &Ending::worst_regret);
  return check;
}

TunerComparison compare_tuners(const RecordedTable& table, const TunersOptions& options) {
  if (options.seeds < 1) fail_input("expected one seed or more, not {}", options.seeds);
  if (options.shares.empty()) fail_input("expected a share of the settings to be timed");
  if (!(options.part > 0 && options.part <= 1)) fail_input("expected a part in (0, 1], not {}", options.part);
  const Judge judge(table);
  const auto seeds = static_cast<std::size_t>(options.seeds);
  const std::size_t shares = options.shares.size();
  const std::span<const Strategy> all = strategies();

  // One piece of work a strategy, share and seed; [strategy][share][seed]
  std::vector<Checkpoint> checkpoints(all.size() * shares * seeds);
  const std::size_t pieces = checkpoints.size() + static_cast<std::size_t>(options.certificates);
  std::mutex mutex;
  std::size_t done = 0;
  const auto finish_one = [&] {
    const std::scoped_lock lock(mutex);
    ++done;
    if (options.on_progress) options.on_progress(static_cast<double>(done) / static_cast<double>(pieces));
  };
  const CertificateCheck certificate = check_certificate(
      table, {.seeds = options.certificates, .part = options.part, .threads = options.threads, .on_done = finish_one},
      [&](const RecordedTable& of, std::uint64_t seed) {
        return std::make_unique<ReplaySource>(of, seed, options.correlation);
      });
  parallel_for(static_cast<int>(checkpoints.size()), options.threads, [&](int index) {
    const auto i = static_cast<std::size_t>(index);
    const std::uint64_t seed = i % seeds + 1;
    const SeedTable given(table, options.part, seed);
    const StrategyTask task{.seed = seed, .first = given.first};
    checkpoints[i] =
        evaluate(given.table, given.judge, all[i / seeds / shares], task, {&options.shares[i / seeds % shares], 1})
            .front();
    finish_one();
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
      .part = options.part,
      .lines = {},
      .correlation = options.correlation,
      .certificate = certificate};
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
          {"part", comparison.part},
          {"correlation", comparison.correlation},
          {"certificate", certificate_json(comparison.certificate)},
          {"strategies", std::move(lines)}};
}

}  // namespace reliefbench
