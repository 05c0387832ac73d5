#include <fmt/format.h>

#include <memory>
#include <optional>

#include "kernels/base/console.h"
#include "tuner/cli/format.h"
#include "tuner/cli/options.h"
#include "tuner/cli/track.h"
#include "tuner/history/ingest.h"

namespace reliefbench {
namespace {

constexpr std::size_t kMostSkipped = 5;  // lines a night

struct IngestArguments {
  std::vector<std::string> sources;
  std::string database;
  NightLabels labels;
  bool json = false;
};

/// What became of one source.
struct Import {
  std::string source;
  std::string state;  ///< "imported", "known" or "refused"
  std::int64_t run = 0;
  std::size_t cases = 0;
  std::vector<std::string> skipped{};
  std::string doubt{};
  std::string error{};
};

nlohmann::json import_json(const Import& import) {
  nlohmann::json entry = {{"source", import.source}, {"state", import.state}};
  if (import.state == "imported")
    entry.update({{"run", import.run}, {"cases", import.cases}, {"skipped", import.skipped}});
  if (!import.doubt.empty()) entry["doubt"] = import.doubt;
  if (!import.error.empty()) entry["error"] = import.error;
  return entry;
}

void print_import(const Import& import) {
  const std::string source = one_line(import.source);
  if (import.state == "known") return put("{}: is there already\n", source);
  put("{}: run {}, {} cases{}\n", source, import.run, import.cases,
      import.skipped.empty() ? "" : fmt::format(", {} left out", import.skipped.size()));
  if (!import.doubt.empty()) put("  {}\n", one_line(import.doubt));
  for (std::size_t i = 0; i < std::min(kMostSkipped, import.skipped.size()); ++i)
    put("  {}\n", one_line(import.skipped[i]));
  if (import.skipped.size() > kMostSkipped)
    put("  ... and {} more (--json has them)\n", import.skipped.size() - kMostSkipped);
}

/// Does some work for a source, whose own fault ends nothing but that work.
/// returns: whether it is done
template <typename Work>
bool is_done(Import& import, const Work& work) {
  try {
    work();
  } catch (const Error& error) {
    if (error.code() != Exit::bad_input) throw;
    import.error = error.what();
  }
  return import.error.empty();
}

/// history: opened, and made, by the first source that is good
Import import_source(const std::string& source, const IngestArguments& arguments, std::optional<History>& history) {
  Import import{.source = source, .state = "refused"};
  Night night;
  if (!is_done(import, [&] { night = read_night(source, arguments.labels); })) return import;
  if (!history) history.emplace(arguments.database, History::Access::write);
  std::optional<std::int64_t> run;
  if (!is_done(import, [&] { run = history->add(night); })) return import;
  import.state = run ? "imported" : "known";
  import.run = run.value_or(0);
  import.cases = night.values.size();
  import.skipped = std::move(night.skipped);
  if (run) import.doubt = doubt_of_clock(*history, night.run);
  return import;
}

Exit ingest_command(const IngestArguments& arguments) {
  Exit result = Exit::done;
  std::optional<History> history;
  nlohmann::json list = nlohmann::json::array();
  for (const std::string& source : arguments.sources) {
    const Import import = import_source(source, arguments, history);
    list.push_back(import_json(import));
    if (import.state == "refused") result = Exit::bad_input;
    if (import.state == "refused") print_error(import.error);
    if (!arguments.json && import.state != "refused") print_import(import);
  }
  if (arguments.json) print_json(list, 2);
  return result;
}

}  // namespace

std::string doubt_of_clock(const History& history, const RunRow& run) {
  const std::int64_t later = history.runs_after(run.machine, run.unix_s);
  if (later == 0) return "";
  return fmt::format("{} of {} {} later: is its clock right?", later == 1 ? "1 run" : fmt::format("{} runs", later),
                     run.machine, later == 1 ? "is" : "are");
}

void add_track_ingest(CLI::App& track, Exit& exit_code) {
  CLI::App* command = track.add_subcommand("ingest", "import runs' folders, or Google Benchmark's JSON files");
  const auto arguments = std::make_shared<IngestArguments>();
  command->add_option("DIR", arguments->sources, "folders of finished sweeps and tunes, JSON files")
      ->required()
      ->expected(1, -1);
  add_database_option(*command, arguments->database);
  add_label_options(*command, arguments->labels);
  add_json_option(*command, arguments->json);
  command->footer(
      "What was imported before is known by its content and left alone. A source that is refused does not keep the\n"
      "others out; exit code 2 then. Of Google Benchmark, versions 1.7 to 1.9: repetitions are samples; where there "
      "are\n"
      "aggregates alone, their median counts. A tune's folder holds only what its search timed that night.\n"
      "Example:\n  reliefbench track ingest out/night --db history.db --commit $(git rev-parse HEAD)");
  command->callback([arguments, &exit_code] { exit_code = ingest_command(*arguments); });
}

}  // namespace reliefbench
