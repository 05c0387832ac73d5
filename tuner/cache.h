#pragma once
#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace reliefbench {

/// Results that are a pure function of their inputs, kept on disk by the SHA-256 of those inputs.
/// Files are written whole (temporary file, then rename) with their digest; a damaged file counts as absent.
class Cache {
 public:
  /// The folder: $RELIEFBENCH_CACHE, else $XDG_CACHE_HOME/reliefbench, else $HOME/.cache/reliefbench, else a folder
  /// under the system's temporary one.
  [[nodiscard]] static std::filesystem::path default_folder();

  explicit Cache(std::filesystem::path folder) : folder_(std::move(folder)) {}

  [[nodiscard]] std::optional<std::vector<std::byte>> get(std::string_view key) const;
  /// A cache that can't be written is not an error: the value is then computed again next time.
  void put(std::string_view key, std::span<const std::byte> value) const;

 private:
  [[nodiscard]] std::filesystem::path file(std::string_view key) const;
  std::filesystem::path folder_;
};

}  // namespace reliefbench
