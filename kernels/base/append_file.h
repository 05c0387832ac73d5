#pragma once
#include <filesystem>
#include <string>
#include <string_view>

namespace reliefbench {

/// A text file that only grows, by whole lines. One process at a time holds it (flock). Opening cuts off a torn last
/// line: the rest of a write that a crash interrupted.
class AppendFile {
 public:
  explicit AppendFile(std::filesystem::path path);  ///< throws: Error(bad_input): unwritable, held by another process
  ~AppendFile();
  AppendFile(const AppendFile&) = delete;
  AppendFile& operator=(const AppendFile&) = delete;

  /// Writes the line and its newline in one write(2); on failure the file is as it was.
  /// line: without newlines. throws: Error(environment): disk full and the like
  void append(std::string_view line);

 private:
  std::filesystem::path path_;
  int fd_ = -1;
};

/// The whole of a file. throws: Error(bad_input): missing or unreadable
[[nodiscard]] std::string read_file(const std::filesystem::path& path);

}  // namespace reliefbench
