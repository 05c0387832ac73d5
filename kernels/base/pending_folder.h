#pragma once
#include <filesystem>

namespace reliefbench {

/// A folder that is being filled and does not stand in its place yet. The temporary folder beside the place has a name
/// that nobody can foresee, is locked while its maker lives, and goes with the object; what a killed process left of
/// such folders goes when the next one is made there.
class PendingFolder {
 public:
  /// throws: FileError; Error(bad_input): something but an empty folder lies in the place
  explicit PendingFolder(const std::filesystem::path& place);
  ~PendingFolder();
  PendingFolder(const PendingFolder&) = delete;
  PendingFolder& operator=(const PendingFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return temporary_; }  ///< where to write
  /// Takes its place, once, with all that was written on disk. throws: FileError
  void commit();

 private:
  std::filesystem::path place_;
  std::filesystem::path temporary_;
  int fd_ = -1;
};

}  // namespace reliefbench
