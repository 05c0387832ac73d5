#include "tuner/measure/merge.h"

#include <system_error>
#include <utility>

#include "kernels/base/file_error.h"
#include "kernels/base/pending_folder.h"
#include "tuner/measure/run_info.h"
#include "tuner/measure/run_results.h"
#include "tuner/results/run_files.h"
#include "tuner/results/run_folder.h"
#include "tuner/results/run_question.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;

std::vector<Run> load_runs(std::span<const fs::path> folders) {
  std::vector<Run> runs;
  for (auto folder = folders.begin(); folder != folders.end(); ++folder) {
    std::error_code missing;
    for (auto before = folders.begin(); before != folder; ++before)
      if (fs::equivalent(*before, *folder, missing)) fail_input("{}: stands twice", folder->string());
    runs.push_back(load_run(*folder));
  }
  return runs;
}

void write_joined(const JoinedRuns& joined) {
  const Run& run = joined.run;
  RunStore store(run.folder, run.info["identity"]);
  for (const Record& record : run.records) store.append(record);
  for (const Sample& sample : run.samples) store.append(sample);
  for (const BlockState& block : run.blocks) store.append(block);
  store.write_info(run.info);
}

/// Of a picture that two folders have, the first is taken: they are of one case or one reference.
void copy_pictures(const fs::path& from, const fs::path& to) {
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(from / kImagesFolder, none)) {
    const fs::path name = entry.path().filename();
    if (!is_image_name(name.string()) || !fs::is_regular_file(entry.symlink_status(none))) continue;
    std::error_code error;
    fs::copy_file(entry.path(), to / kImagesFolder / name, fs::copy_options::skip_existing, error);
    if (error) fail_file(to / kImagesFolder / name, "cannot be written", error.value());
  }
}

}  // namespace

JoinedRuns merge_runs(std::span<const fs::path> folders, const fs::path& output) {
  JoinedRuns joined = join(load_runs(folders));
  joined.run.info["argv"] = command_line();
  PendingFolder pending(output);
  joined.run.folder = pending.path();
  write_joined(joined);
  make_images_folder(pending.path());
  for (const fs::path& folder : folders) copy_pictures(folder, pending.path());
  const RunQuestion question = question_of(joined.run);
  Config config;
  config.front_error = question.error_metric;
  config.front_constraints = question.constraints;
  write_results(config, joined.run);
  pending.commit();
  joined.run.folder = output;
  return joined;
}

}  // namespace reliefbench
