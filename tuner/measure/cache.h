#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace reliefbench {

/// Results that are a pure function of their inputs, kept on disk by the SHA-256 of those inputs.
/// Files are written whole (temporary file, then rename) with a digest of key and value: what is damaged, another key's
/// or no file counts as absent.
class Cache {
 public:
  /// The user's: that of default_folder(), trimmed to kMostBytes.
  [[nodiscard]] static Cache open();

  /// The folder: $RELIEFBENCH_CACHE, else $XDG_CACHE_HOME/reliefbench, else $HOME/.cache/reliefbench, else a folder
  /// under the system's temporary one.
  [[nodiscard]] static std::filesystem::path default_folder();

  explicit Cache(std::filesystem::path folder) : folder_(std::move(folder)) {}

  [[nodiscard]] std::optional<std::vector<std::byte>> get(std::string_view key) const;
  /// A cache that can't be written is not an error: the value is then computed again next time.
  void put(std::string_view key, std::span<const std::byte> value) const;
  /// Removes the values that were not used for longest until the others take most_bytes or less. Where another process
  /// still wants one, it computes it again.
  void trim(std::uintmax_t most_bytes) const;

  [[nodiscard]] std::filesystem::path file(std::string_view key) const;

  static constexpr std::uintmax_t kMostBytes = std::uintmax_t{8} << 30U;

 private:
  std::filesystem::path folder_;
};

}  // namespace reliefbench
