#pragma once
#include <filesystem>
#include <set>

namespace reliefbench {

/// What a folder is to a run that is to be kept in it.
enum class FolderState {
  fresh,  ///< nothing of a run, or what a start leaves that was killed before its run.json
  run,    ///< there is a run.json
};

/// The one place that decides it. Asked while results.jsonl is locked.
/// throws: Error(bad_input): results without a run.json, pictures that would go through a link
[[nodiscard]] FolderState folder_state(const std::filesystem::path& folder);

/// Makes the folder of a run's pictures. throws: FileError; Error(bad_input): a link or a file lies in its place
void make_images_folder(const std::filesystem::path& folder);

/// Removes the run's pictures that are not among `kept` (paths below `folder`, as image_path() names them). Files that
/// it would not have named stay.
void remove_other_pictures(const std::filesystem::path& folder, const std::set<std::filesystem::path>& kept);

/// Removes what killed processes left half-written in a run's folder.
void remove_stale_run_files(const std::filesystem::path& folder);

}  // namespace reliefbench
