#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
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

/// How values of a type are kept.
template <typename Value>
struct Codec {
  std::function<std::vector<std::byte>(const Value&)> write;
  /// Nothing for bytes that are not just what is asked for.
  std::function<std::optional<Value>(std::span<const std::byte>)> read;
};

template <typename Value>
struct Made {
  Value value;
  bool is_new = false;  ///< it was not in the cache
};

/// What `make` returns, or returned for this key before.
template <typename Value, typename Make>
[[nodiscard]] Made<Value> cached(const Cache& cache, std::string_view key, const Codec<Value>& codec,
                                 const Make& make) {
  if (const auto bytes = cache.get(key))
    if (std::optional<Value> known = codec.read(*bytes)) return {.value = std::move(*known)};
  Made<Value> made{.value = make(), .is_new = true};
  cache.put(key, codec.write(made.value));
  return made;
}

/// The values that were asked for last, in memory.
template <typename Value>
class Recent {
 public:
  explicit Recent(std::size_t most) : most_(most) {}

  /// What `make` returns, or returned for this key before; valid until `most` others were asked for.
  template <typename Make>
  [[nodiscard]] const Value& get(const std::string& key, const Make& make) {
    for (auto it = values_.begin(); it != values_.end(); ++it) {
      if (it->first != key) continue;
      values_.splice(values_.begin(), values_, it);
      return it->second;
    }
    if (values_.size() == most_) values_.pop_back();  // first: values are large
    values_.emplace_front(key, make());
    return values_.front().second;
  }

 private:
  std::size_t most_;
  std::list<std::pair<std::string, Value>> values_;  // latest first
};

}  // namespace reliefbench
