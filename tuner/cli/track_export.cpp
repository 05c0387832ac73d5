#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>

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

struct HistoryExport {
  std::string database;
  std::string format;
  History::Query query;
  std::optional<std::int64_t> run;
  std::string output;  ///< "": standard output
};

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

void export_history(const HistoryExport& arguments) {
  const ExportFormat& format = *std::ranges::find(export_formats(), arguments.format, &ExportFormat::id);
  History::Query query = arguments.query;
  query.run = arguments.run.value_or(0);
  if (arguments.run && query.run < 1) fail_input("--run {}: expected a run's number, from 1", query.run);
  const History history(arguments.database, History::Access::read);
  const std::string text = format.text(view_of(history, query, format));
  if (arguments.output.empty())
    fmt::print("{}", text);
  else
    write_output(arguments.output, text);
}

}  // namespace

void add_track_export(CLI::App& track, Exit& /*exit_code*/) {
  CLI::App* command = track.add_subcommand("export", "a history as other programs read it");
  std::vector<std::string> ids;
  for (const ExportFormat& format : export_formats()) ids.push_back(format.id);
  const auto arguments = std::make_shared<HistoryExport>();
  command->add_option("--format", arguments->format, fmt::format("{}", fmt::join(ids, " | ")))
      ->type_name("ID")
      ->required()
      ->check(CLI::IsMember(ids));
  add_database_option(*command, arguments->database);
  add_night_options(*command, arguments->query);
  command->add_option("--run", arguments->run, "only that night; of all but otava-csv the last")->type_name("N");
  command->add_option("-o,--output", arguments->output, "a file; standard output")->type_name("FILE");
  command->footer(
      "gbench: Google Benchmark's JSON, a repetition a sample, which `track ingest` reads, too. otava-csv: Apache "
      "Otava's\n"
      "CSV, a line a night and a column a series. bencher: Bencher's metric format. github-action:\n"
      "github-action-benchmark's customSmallerIsBetter. What is tracked of a case is its time relative to the control\n"
      "case; raw medians in ns stand beside it where the format has room.\n"
      "Example:\n  reliefbench track export --db history.db --format bencher -o night.json");
  command->callback([arguments] { export_history(*arguments); });
}

}  // namespace reliefbench
