#pragma once
#include <filesystem>
#include <set>
#include <span>
#include <string>

#include "tuner/measure/prepare.h"
#include "tuner/measure/progress.h"
#include "tuner/plan/config.h"
#include "tuner/results/case_mark.h"

namespace reliefbench {

/// Least side of a picture, for people to see something. A scene whose frames are smaller is drawn a whole number of
/// times as large, at most four times: the same view in more pixels.
inline constexpr int kPictureSide_px = 512;
[[nodiscard]] SceneSpec pictured_scene(const SceneSpec& scene);

/// Which cases of a run have pictures in its folder.
enum class Pictured {
  shown,  ///< what a report shows: the fronts, what is recommended within the run's budgets, and what is held against
          ///< it
  all,
  none,
};

/// The records of those cases, each once.
[[nodiscard]] std::set<const Record*> pictured_records(std::span<const Record> records, const Config& config,
                                                       Pictured which);

/// Removes a run's pictures of all other cases.
void remove_other_pictures(const std::filesystem::path& folder, const std::set<const Record*>& pictured);

struct PictureWork {
  Session& session;
  Preparer& preparer;
  WallSplit& split;
  CaseMark& mark;
  std::filesystem::path folder;  ///< of the run
  Progress& progress;            ///< of the pictures alone; told of a case that can't be drawn any more
};

/// Draws those of the cases that are of the session's backend and whose pictures the folder lacks, and writes them.
/// cases, scenes: of the run. throws: FileError; Error(environment): the device was lost and can't be opened again
void write_pictures(const PictureWork& work, const std::set<const Record*>& pictured, std::span<const Case> cases,
                    std::span<const SceneSpec> scenes);

}  // namespace reliefbench
