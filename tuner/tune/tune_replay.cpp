#include <memory>
#include <optional>

#include "kernels/base/atomic_file.h"
#include "kernels/base/json_file.h"
#include "kernels/base/sha256.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/case_table.h"
#include "tuner/results/coarse_filter.h"
#include "tuner/results/json_text.h"
#include "tuner/results/recorded_run.h"
#include "tuner/results/run_files.h"
#include "tuner/tune/tune_search.h"
#include "tuner/tune/tuner.h"

namespace reliefbench {
namespace {

nlohmann::json identity_of(const RecordedTable& table, const TuneOptions& options) {
  const TuneQuestion& question = options.question;
  std::string text;
  for (std::size_t i = 0; i < table.samples.size(); ++i)
    text += table.space.candidates[i].id + sha256(std::as_bytes(std::span(table.samples[i])));
  nlohmann::json identity = {{"schema", kSchemaVersion},
                             {"replay", sha256(text)},
                             {"tune",
                              {{"constraints", table.constraints},
                               {"epsilon", question.epsilon},
                               {"confidence", question.confidence},
                               {"seed", question.seed}}}};
  if (options.fleet) identity["tune"]["fleet"] = fleet_sha256(*options.fleet);
  return identity;
}

RecordedQuery query_of(const std::string& scene, const TuneOptions& options) {
  RecordedQuery query;
  query.backend = options.backend;
  query.scene = scene;
  if (!options.question.max_error.empty()) query.constraints.emplace(options.question.max_error);
  return query;
}

/// As far as a table that stands alone says, by its rows.
CoarseFilter filter_of(const std::filesystem::path& recorded, const RecordedTable& table) {
  const std::filesystem::path info = recorded / kRunFile;
  std::error_code ignored;
  if (std::filesystem::is_regular_file(info, ignored)) return {read_json(info), table.backend};
  CoarseFilter filter;
  for (const TableRow& row : load_case_table(recorded))
    if (row.backend == table.backend && row.device == table.device) filter.add(row);
  return filter;
}

/// A recorded sweep of one scene, whose samples are the noise.
class RecordedSource final : public TuneSource {
 public:
  RecordedSource(const std::filesystem::path& recorded, const std::string& scene, const TuneOptions& options)
      : name_(recorded.string()), options_(options), table_(load_recorded(recorded, query_of(scene, options))) {
    if (options.fleet) whole_ = load_fleet_run(recorded);
    if (options.output.empty()) return;
    store_.emplace(options.output, identity_of(table_, options));
    book_ = SampleBook(*store_, std::nullopt);
  }

  TuneResult blank() const override {
    TuneResult result{.error_metric = table_.error_metric,
                      .backend = table_.backend,
                      .device = table_.device,
                      .filter = filter_of(name_, table_),
                      .scenes = {table_.scene},
                      .scene_keys = {SceneKey{table_.scene_key}},
                      .subjects = {table_.scene},
                      .replayed = name_};
    if (options_.question.max_error.empty()) result.constraints = parse_budgets(table_.constraints);
    result.counts.settings = result.counts.scored = static_cast<int>(table_.space.candidates.size());
    return result;
  }
  std::optional<double> asked_error() const override { return table_.asked_error; }
  std::int64_t patience() const override {
    return options_.time_limit_s ? 0 : kReplayPatience * std::ssize(table_.samples);
  }

  SearchSpace space(std::span<const std::size_t> /*scenes*/) override {
    SearchSpace space = table_.space;
    for (Candidate& candidate : space.candidates) candidate.id = setting_id(parse_setting(candidate.id));
    return space;
  }

  std::unique_ptr<TimeSource> times(std::span<const std::size_t> /*scenes*/) override {
    BookSource::Scene cases;
    for (const Candidate& candidate : table_.space.candidates) cases.case_ids.push_back(candidate.id);
    return std::make_unique<BookSource>(book_, std::vector{cases}, Combine::weighted,
                                        [this](std::span<const BookSource::Wanted> round) { draw(round); });
  }

  std::int64_t memory_bytes(std::size_t /*scene*/, std::size_t candidate) override {
    return table_.memory_bytes[candidate];
  }
  std::vector<double> times_ns(std::size_t /*scene*/, const std::string& /*setting*/) const override { return {}; }
  std::pair<std::string, std::string> nearest() const override {
    if (table_.nearest.empty()) return {};
    return {setting_id(parse_setting(table_.nearest)), table_.miss};
  }
  TunePlace place() const override {
    const auto row = std::ranges::find_if(whole_.rows, [this](const TableRow& one) { return is_replayed(one); });
    return {.device = measured_device(*row), .scene = table_.scene, .scene_key = SceneKey{table_.scene_key}};
  }
  FleetRun timed_run() override {
    FleetRun run = whole_;
    std::erase_if(run.rows, [this](const TableRow& row) { return !is_replayed(row); });
    for (TableRow& row : run.rows) row.samples_ns = book_.times(row.case_id);
    std::erase_if(run.rows, [](const TableRow& row) { return row.samples_ns.size() < kLeastTold; });
    return run;
  }
  void take_failure(const CaseFailed& failed, bool /*is_left_out*/) override { throw failed; }  // nothing is drawn
  Progress& progress() override { return progress_; }

 private:
  [[nodiscard]] bool is_replayed(const TableRow& row) const {
    return row.backend == table_.backend && row.device == table_.device && row.scene == table_.scene;
  }
  void draw(std::span<const BookSource::Wanted> round) {
    for (const BookSource::Wanted& wanted : round) {
      const std::string& id = table_.space.candidates[wanted.candidate].id;
      const auto index = static_cast<int>(book_.samples(id).size());
      book_.append({.case_id = id,
                    .frames = 1,
                    .frame_time_ns = replay_.frame_ns(wanted.candidate, index),
                    .at_ns = static_cast<double>(book_.size())});
    }
  }

  std::string name_;
  const TuneOptions& options_;
  Progress progress_{options_.quiet};
  RecordedTable table_;
  FleetRun whole_{};  ///< all that was recorded; where a fleet asks
  ReplaySource replay_{table_, options_.question.seed};
  std::optional<RunStore> store_;
  SampleBook book_{std::nullopt};
};

}  // namespace

TuneResult replay_tune(const std::filesystem::path& recorded, const std::string& scene, const TuneOptions& options) {
  TuneClock clock(options);
  RecordedSource source(recorded, scene, options);
  TuneResult result = tune(source, options, clock, match_fleet(source, options));
  result.wall_s = clock.elapsed_s();
  if (!options.output.empty()) write_atomically(options.output / kTuneFile, json_text(tune_json(result), 1) + "\n");
  return result;
}

}  // namespace reliefbench
