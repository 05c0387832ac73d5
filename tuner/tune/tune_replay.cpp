#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "kernels/base/atomic_file.h"
#include "kernels/base/error.h"
#include "kernels/base/sha256.h"
#include "tuner/measure/progress.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/recorded_run.h"
#include "tuner/tune/tune_search.h"

namespace reliefbench {
namespace {

nlohmann::json identity_of(const RecordedTable& table, const TuneQuestion& question) {
  std::string text;
  for (std::size_t i = 0; i < table.samples.size(); ++i)
    text += table.space.candidates[i].id + sha256(std::as_bytes(std::span(table.samples[i])));
  return {{"schema", kSchemaVersion},
          {"replay", sha256(text)},
          {"tune",
           {{"constraints", table.constraints},
            {"epsilon", question.epsilon},
            {"confidence", question.confidence},
            {"seed", question.seed}}}};
}

RecordedQuery query_of(const std::string& scene, const TuneOptions& options) {
  RecordedQuery query;
  query.backend = options.backend;
  query.scene = scene;
  if (!options.question.max_error.empty()) query.constraints.emplace(options.question.max_error);
  return query;
}

}  // namespace

TuneResult replay_tune(const std::filesystem::path& recorded, const std::string& scene, const TuneOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  const auto elapsed_s = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  const RecordedTable table = load_recorded(recorded, query_of(scene, options));
  TuneResult result{.question = options.question,
                    .error_metric = table.error_metric,
                    .backend = table.backend,
                    .device = table.device,
                    .scenes = {table.scene},
                    .scene_keys = {SceneKey{table.scene_key}},
                    .subjects = {table.scene},
                    .replayed = recorded.string()};
  if (options.question.max_error.empty())
    for (const std::string& text : table.constraints) result.constraints.push_back(parse_budget(text));
  result.space = table.space;
  for (Candidate& candidate : result.space.candidates) candidate.id = setting_id(parse_setting(candidate.id));
  result.counts.settings = result.counts.scored = static_cast<int>(result.space.candidates.size());

  ReplaySource replay(table, options.question.seed);
  std::optional<RunStore> store;
  std::optional<SampleBook> book;
  std::optional<BookSource> source;
  if (!options.output.empty()) {
    store.emplace(options.output, identity_of(table, options.question));
    book.emplace(*store, std::nullopt);
    BookSource::Scene cases;
    for (const Candidate& candidate : table.space.candidates) cases.case_ids.push_back(candidate.id);
    source.emplace(*book, std::vector{cases}, Combine::weighted, [&](std::span<const BookSource::Wanted> round) {
      for (const BookSource::Wanted& wanted : round) {
        const std::string& id = table.space.candidates[wanted.candidate].id;
        const auto index = static_cast<int>(book->times(id).size());
        book->append({.case_id = id,
                      .round = index,
                      .frames = 1,
                      .frame_time_ns = replay.frame_ns(wanted.candidate, index),
                      .at_ns = static_cast<double>(book->size())});
      }
    });
  }
  TimeSource& times = source ? static_cast<TimeSource&>(*source) : replay;
  Progress progress(options.quiet);
  search_into(
      result, times,
      [&] {
        const bool over = options.is_interrupted() || elapsed_s() > options.time_limit_s.value_or(1e9);
        result.is_stopped |= over;
        return over;
      },
      [&](const SearchProgress& now) {
        show(progress, now, options.question, elapsed_s() / options.time_limit_s.value_or(1e9));
      },
      table.asked_error, [&](std::size_t candidate) { return table.memory_bytes[candidate]; });
  progress.finish();
  if (!table.nearest.empty()) {
    result.nearest = setting_id(parse_setting(table.nearest));
    result.miss = table.miss;
  }
  result.wall_s = elapsed_s();
  if (store) write_atomically(options.output / kTuneFile, tune_json(result).dump(1) + "\n");
  return result;
}

}  // namespace reliefbench
