#pragma once
#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace reliefbench {

/// A text file that only grows, by whole lines. One process at a time holds it (flock).
class AppendFile {
 public:
  /// Opens or makes the file and locks it; what it holds is left as it is.
  /// throws: FileError, Error(bad_input): unwritable, a link, held by another process
  explicit AppendFile(std::filesystem::path path);
  ~AppendFile();
  AppendFile(const AppendFile&) = delete;
  AppendFile& operator=(const AppendFile&) = delete;

  [[nodiscard]] bool is_empty() const;
  /// Cuts off a torn last line: the rest of a write that a crash interrupted.
  void cut_torn_line();
  /// Writes the line and its newline, in one write(2) unless the system takes less; on failure the file is as it was.
  /// line: without newlines. throws: FileError
  void append(std::string_view line);
  /// Removes the file, if this object made it.
  void remove_if_made();

 private:
  void open();

  std::filesystem::path path_;
  int fd_ = -1;
  bool is_made_ = false;
};

/// The whole of a file, or of a pipe. throws: FileError, Error(bad_input): missing, unreadable, a folder or a device
[[nodiscard]] std::string read_file(const std::filesystem::path& path);

/// Of a line of records or of a row of a table: a record takes 2 kB.
inline constexpr std::size_t kMostLineBytes = std::size_t{1} << 20U;

/// The lines of such a file, one after the other; what follows the last newline is none. Of a line over most_bytes,
/// take() gets some text that is longer than most_bytes: enough to refuse it.
/// throws: as read_file(), and what `take` throws
void read_lines(const std::filesystem::path& path, std::size_t most_bytes,
                const std::function<void(std::string_view)>& take);

}  // namespace reliefbench
