#pragma once
#include <filesystem>
#include <functional>
#include <iosfwd>
#include <string>
#include <string_view>

namespace reliefbench {

/// Puts a file's bytes into a stream, which throws what goes wrong with the file.
using WriteBytes = std::function<void(std::ostream&)>;

/// A file that is whole on disk, but does not stand in its place yet. The temporary file beside the place has a name
/// that nobody can foresee, follows no link, is locked while its writer lives, and goes with the object.
class PendingFile {
 public:
  /// throws: FileError
  PendingFile(std::filesystem::path path, std::string_view bytes);
  PendingFile(std::filesystem::path path, const WriteBytes& write);
  ~PendingFile();
  PendingFile(PendingFile&& other) noexcept;
  PendingFile& operator=(PendingFile&&) = delete;

  /// Takes its place, once, instead of what lies there. throws: FileError
  void commit();
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  void open();
  void discard();

  std::filesystem::path path_;
  std::filesystem::path temporary_;
  int fd_ = -1;
};

/// Writes a file whole or not at all: temporary file beside it, fsync, rename. throws: FileError
void write_atomically(const std::filesystem::path& path, std::string_view bytes);
/// The same without holding all bytes at once.
void write_atomically(const std::filesystem::path& path, const WriteBytes& write);

/// The same for a file that a command was asked for by name, so that what killed writers left beside it goes, too.
void write_output(const std::filesystem::path& path, std::string_view bytes);

/// What a temporary file or folder is called: something else every time.
[[nodiscard]] std::string temporary_name();
[[nodiscard]] bool is_temporary_name(std::string_view name);

/// Removes the temporary files that killed processes left in a folder; other files, and those of living writers, stay.
void remove_stale_temporaries(const std::filesystem::path& folder);

}  // namespace reliefbench
