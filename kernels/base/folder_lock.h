#pragma once
#include <filesystem>

namespace reliefbench {

/// Keeps other processes that ask likewise out of a folder, for as long as it lives. Where the file system has no locks
/// of folders, nobody is kept out.
class FolderLock {
 public:
  /// throws: Error(bad_input): another one has it; FileError: it is not there, or no folder
  explicit FolderLock(const std::filesystem::path& folder);
  ~FolderLock();
  FolderLock(FolderLock&& other) noexcept;
  FolderLock& operator=(FolderLock&&) = delete;
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int fd_;
};

}  // namespace reliefbench
