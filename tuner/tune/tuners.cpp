#include "tuner/tune/tuners.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <mutex>
#include <utility>

#include "kernels/base/error.h"
#include "kernels/base/parallel.h"
#include "tuner/plan/setting_space.h"
#include "tuner/search/search.h"
#include "tuner/search/strategies.h"
#include "tuner/tune/tune_search.h"

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

nlohmann::json pair_json(const Spread& figure) {
  const auto number = [](double value) { return std::isinf(value) ? nlohmann::json(nullptr) : nlohmann::json(value); };
  return {{"mean", number(figure.mean)}, {"worst", number(figure.worst)}};
}

nlohmann::json point_json(const TunerPoint& point) {
  return {{"share", point.share},
          {"timed", pair_json(point.timed)},
          {"samples", pair_json(point.samples)},
          {"worst_regret", pair_json(point.worst_regret)},
          {"mean_regret", pair_json(point.mean_regret)},
          {"hypervolume", pair_json(point.hypervolume)},
          {"false_front", pair_json(point.false_front)},
          {"uncovered", point.uncovered}};
}

/// What every strategy times first. A recorded candidate is called by its case, a default by its setting.
std::vector<std::size_t> first_of(SearchSpace space) {
  for (Candidate& candidate : space.candidates) candidate.id = setting_id(parse_setting(candidate.id));
  return first_settings(space);
}

/// How one seed's search ended.
struct Ending {
  bool is_certified = false;
  bool is_bounded = true;
  double frames_per_setting = 0;
  double worst_regret = 0;
};

Ending ending_of(const RecordedTable& table, const Judge& judge, const SearchOptions& options, TimeSource& times) {
  const SearchResult found = search(table.space, times, options);
  std::vector<std::size_t> picks;
  for (const BudgetAnswer& answer : found.answers) picks.push_back(answer.pick);
  Ending ending{.is_certified = found.is_certified,
                .frames_per_setting = static_cast<double>(found.samples) / static_cast<double>(table.samples.size()),
                .worst_regret = judge.judge(picks).worst_regret};
  for (std::size_t i = 0; i < found.states.size(); ++i) {
    const CandidateState& state = found.states[i];
    if (state.evidence == Evidence::measured && state.low_ns)
      ending.is_bounded &= std::log(*state.low_ns) <= judge.true_log_times()[i] + std::log1p(options.epsilon / 2);
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
          {"frames_per_setting", pair_json(check.frames_per_setting)},
          {"worst_regret", pair_json(check.worst_regret)}};
}

}  // namespace

CertificateCheck check_certificate(const RecordedTable& table, int seeds,
                                   const std::function<std::unique_ptr<TimeSource>(std::uint64_t)>& replay, int threads,
                                   const std::function<void()>& on_done) {
  const Judge judge(table);
  const SearchOptions options{.first = first_of(table.space), .max_samples = kPatience * std::ssize(table.samples)};
  std::vector<Ending> endings(static_cast<std::size_t>(seeds));
  parallel_for(seeds, threads, [&](int index) {
    SearchOptions seeded = options;
    seeded.seed = static_cast<std::uint64_t>(index) + 1;
    endings[static_cast<std::size_t>(index)] = ending_of(table, judge, seeded, *replay(seeded.seed));
    if (on_done) on_done();
  });
  CertificateCheck check{.epsilon = options.epsilon, .confidence = options.confidence, .seeds = seeds};
  for (const Ending& ending : endings) {
    check.certified += ending.is_certified ? 1 : 0;
    check.held += ending.is_certified && ending.worst_regret <= options.epsilon ? 1 : 0;
    check.bounded += ending.is_bounded ? 1 : 0;
    for (const auto& [value, spread] : {std::pair(ending.frames_per_setting, &check.frames_per_setting),
                                        std::pair(ending.worst_regret, &check.worst_regret)}) {
      spread->mean += value / static_cast<double>(endings.size());
      spread->worst = std::max(spread->worst, value);
    }
  }
  return check;
}

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
  const std::size_t pieces = checkpoints.size() + static_cast<std::size_t>(options.certificates);
  std::mutex mutex;
  std::size_t done = 0;
  const auto finish_one = [&] {
    const std::scoped_lock lock(mutex);
    ++done;
    if (options.on_progress) options.on_progress(static_cast<double>(done) / static_cast<double>(pieces));
  };
  const CertificateCheck certificate = check_certificate(
      table, options.certificates,
      [&](std::uint64_t seed) { return std::make_unique<ReplaySource>(table, seed, options.correlation); },
      options.threads, finish_one);
  parallel_for(static_cast<int>(checkpoints.size()), options.threads, [&](int index) {
    const auto i = static_cast<std::size_t>(index);
    const StrategyTask task{.seed = i % seeds + 1, .first = first};
    checkpoints[i] =
        evaluate(table, judge, all[i / seeds / shares], task, {&options.shares[i / seeds % shares], 1}).front();
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
          {"correlation", comparison.correlation},
          {"certificate", certificate_json(comparison.certificate)},
          {"strategies", std::move(lines)}};
}

}  // namespace reliefbench
