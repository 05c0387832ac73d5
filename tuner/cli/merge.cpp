#include "tuner/measure/merge.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "kernels/base/console.h"
#include "kernels/base/error.h"
#include "tuner/cli/commands.h"
#include "tuner/cli/format.h"
#include "tuner/cli/options.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;

struct MergeArguments {
  std::vector<fs::path> folders;
  fs::path output;
  bool json = false;
};

void print_merged_json(const JoinedRuns& joined) {
  const nlohmann::json& info = joined.run.info;
  const nlohmann::json out = {
      {"folder", joined.run.folder.string()},
      {"parts", info.at("parts")},
      {"counts", info.at("counts")},
      {"held_twice", joined.held_twice},
      {"left_out", joined.left_out},
      {"control_case", {{"least", joined.least_control}, {"greatest", joined.greatest_control}}},
      {"missing", joined.missing}};
  print_json(out, 1);
}

void print_merged(const JoinedRuns& joined) {
  const nlohmann::json& info = joined.run.info;
  put("{} cases of {} parts:", joined.run.records.size(), info.at("parts").size());
  for (const auto& item : info.at("counts").at("statuses").items()) put(" {} {}", item.value().dump(), item.key());
  put("\n");
  if (joined.held_twice > 0) put("{} of them in two folders, with the same errors\n", joined.held_twice);
  for (const std::string& folder : joined.left_out) put("{} adds nothing\n", one_line(folder));
  if (info.at("parts").size() > 1)
    put("the control case took {:.2f} to {:.2f} times as long as in the first part; times are relative to it\n",
        joined.least_control, joined.greatest_control);
  print_next_recommend(joined.run.folder);
}

}  // namespace

void add_merge_command(CLI::App& app, Exit& /*exit_code*/) {
  CLI::App* command = app.add_subcommand("merge", "join shards of a sweep, or other runs of a config, into one run");
  const auto arguments = std::make_shared<MergeArguments>();
  command
      ->add_option("DIR", arguments->folders,
                   "run folders; of a case that two hold, the times of the earlier one count")
      ->required()
      ->expected(1, -1);
  command->add_option("-o,--output", arguments->output, "folder of the joined run, which must not be there yet")
      ->type_name("DIR")
      ->required();
  add_json_option(*command, arguments->json);
  command->footer(
      "Kernels, config, scenes, devices' names and drivers must be equal, and so must the errors of a case that two\n"
      "folders hold; else nothing is written. Shards that are missing are named, and the run then counts as "
      "unfinished.\n"
      "Example:\n  reliefbench merge out/shard_* -o out/merged");
  command->callback([arguments] {
    const JoinedRuns joined = merge_runs(arguments->folders, arguments->output);
    arguments->json ? print_merged_json(joined) : print_merged(joined);
    if (!joined.missing.empty()) print_error(joined.missing);
  });
}

}  // namespace reliefbench
