#pragma once
#include <filesystem>
#include <fstream>

#include "tuner/plan/scene_json.h"
#include "tuner/results/run_files.h"
#include "tuner/results/store.h"

namespace reliefbench {

/// Writes a run's files as a sweep leaves them, instead of what lies in its folder.
inline void write_run(const Run& run) {
  std::filesystem::create_directories(run.folder);
  nlohmann::json info = run.info;
  info["scenes"] = scenes_json(run.scenes);
  std::ofstream(run.folder / kRunFile) << info.dump(1);
  std::ofstream results(run.folder / kResultsFile);
  for (const Record& record : run.records) results << nlohmann::json(record).dump() << '\n';
  std::ofstream samples(run.folder / kSamplesFile);
  for (const Sample& sample : run.samples) samples << nlohmann::json(sample).dump() << '\n';
}

}  // namespace reliefbench
