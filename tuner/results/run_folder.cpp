#include "tuner/results/run_folder.h"

#include <array>
#include <string_view>
#include <system_error>

#include "kernels/base/atomic_file.h"
#include "kernels/base/file_error.h"
#include "tuner/results/run_files.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;

bool holds(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error) ? fs::file_size(path, error) > 0 : fs::exists(path, error);
}

/// Pictures are replaced and removed there.
void check_images(const fs::path& images) {
  std::error_code error;
  const fs::file_status status = fs::symlink_status(images, error);
  if (fs::is_symlink(status)) fail_input("{}: is a symbolic link; choose another folder", images.string());
  if (fs::exists(status) && !fs::is_directory(status)) fail_input("{}: expected a folder", images.string());
}

}  // namespace

FolderState folder_state(const fs::path& folder) {
  check_images(folder / kImagesFolder);
  std::error_code error;
  if (fs::exists(folder / kRunFile, error)) return FolderState::run;
  // The first lines are written after run.json: whatever holds some without it is not of an interrupted start.
  for (const std::string_view name :
       {kResultsFile, kSamplesFile, kBlocksFile, kFrontFile, kBenchmarkFile, kTableFile, kT4File})
    if (holds(folder / name))
      fail_input("{}: holds {} but no {}; choose another folder", folder.string(), name, kRunFile);
  return FolderState::fresh;
}

void make_images_folder(const fs::path& folder) {
  const fs::path images = folder / kImagesFolder;
  check_images(images);
  std::error_code error;
  fs::create_directories(images, error);
  if (error) fail_file(images, "cannot be made", error.value());
}

void remove_other_pictures(const fs::path& folder, const std::set<fs::path>& kept) {
  check_images(folder / kImagesFolder);
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder / kImagesFolder, ignored))
    if (is_image_name(entry.path().filename().string()) && !kept.contains(kImagesFolder / entry.path().filename()))
      fs::remove(entry.path(), ignored);
}

void remove_stale_run_files(const fs::path& folder) {
  remove_stale_temporaries(folder);
  remove_stale_temporaries(folder / kImagesFolder);
}

}  // namespace reliefbench
