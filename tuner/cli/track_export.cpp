#include <fmt/format.h>

#include <algorithm>

#include "kernels/base/atomic_file.h"
#include "tuner/cli/options.h"
#include "tuner/cli/track.h"
#include "tuner/history/export.h"
#include "tuner/results/json_text.h"

namespace reliefbench {
namespace {

struct ExportFormat {
  std::string id;
  bool is_of_one_night;
  bool needs_samples;
  std::string (*text)(const HistoryView& view);
};

template <nlohmann::json (*make)(const HistoryView&)>
std::string exported_json(const HistoryView& view) {
  return json_text(make(view), 1) + "\n";
}

const std::vector<ExportFormat>& export_formats() {
  static const std::vector<ExportFormat> all = {{"gbench", true, true, exported_json<google_benchmark_json>},
                                                {"otava-csv", false, false, otava_csv},
                                                {"bencher", true, false, exported_json<bencher_json>},
                                                {"github-action", true, false, exported_json<github_action_json>}};
  return all;
}

/// What a format has of a history: one night, the last one unless another is asked for, or all of them.
HistoryView view_of(const History& history, History::Query query, const ExportFormat& format) {
  if (format.is_of_one_night && query.run == 0) {
    const HistoryView all = history.load(query);
    if (!all.runs.empty()) query.run = all.runs.back().id;
  }
  query.with_samples = format.needs_samples;
  HistoryView view = history.load(query);
  if (view.runs.empty())
    throw Error(Exit::nothing_measured, query.run == 0 ? std::string("export: no night is as asked for")
                                                       : fmt::format("export: there is no run {}", query.run));
  return view;
}

}  // namespace

void add_track_export(CLI::App& track, int& exit_code) {
  CLI::App* command = track.add_subcommand("export", "a history as other programs read it");
  std::vector<std::string> ids;
  for (const ExportFormat& format : export_formats()) ids.push_back(format.id);
  const std::string choices = fmt::format("{}", fmt::join(ids, " | "));
  const CLI::Option* format_option =
      command->add_option("--format", choices)->type_name("ID")->required()->check(CLI::IsMember(ids));
  const CLI::Option* database = add_database_option(*command);
  const NightOptions nights = add_night_options(*command);
  const CLI::Option* run =
      command->add_option("--run", "only that night; of all but otava-csv the last")->type_name("N");
  const CLI::Option* output = command->add_option("-o,--output", "a file; standard output")->type_name("FILE");
  command->footer(
      "gbench: Google Benchmark's JSON, a repetition a sample, which `track ingest` reads, too. otava-csv: Apache "
      "Otava's\n"
      "CSV, a line a night and a column a series. bencher: Bencher's metric format. github-action:\n"
      "github-action-benchmark's customSmallerIsBetter. What is tracked of a case is its time relative to the control\n"
      "case; raw medians in ns stand beside it where the format has room.\n"
      "Example:\n  reliefbench track export --db history.db --format bencher -o night.json");
  command->callback([=, &exit_code] {
    const ExportFormat& format =
        *std::ranges::find(export_formats(), format_option->as<std::string>(), &ExportFormat::id);
    History::Query query = nights.query();
    query.run = value_or(run, std::int64_t{0});
    if (!run->empty() && query.run < 1) fail_input("--run {}: expected a run's number, from 1", query.run);
    const History history(database->as<std::string>(), History::Access::read);
    const std::string text = format.text(view_of(history, query, format));
    if (output->empty())
      fmt::print("{}", text);
    else
      write_output(output->as<std::string>(), text);
    exit_code = static_cast<int>(Exit::done);
  });
}

}  // namespace reliefbench
