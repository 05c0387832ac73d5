#include "kernels/base/cache.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <string>

#include "kernels/base/atomic_file.h"
#include "kernels/base/error.h"
#include "kernels/base/sha256.h"

namespace reliefbench {
namespace {

// A file is its value behind the SHA-256 of key and value, so that a damaged file, or another key's, is told from a
// good one.
constexpr std::size_t kDigestSize = 64;
constexpr std::string_view kExtension = ".bin";

std::string digest(std::string_view key, std::string_view value) {
  return sha256(fmt::format("{} {}", sha256(key), sha256(value)));
}

/// Whether a file is one of a cache's: others may lie in a folder that the user chose.
bool is_entry(const std::filesystem::path& path) {
  const std::string stem = path.stem().string();
  return path.extension() == kExtension && stem.size() == kDigestSize &&
         stem.find_first_not_of("0123456789abcdef") == std::string::npos;
}

}  // namespace

std::filesystem::path Cache::default_folder() {
  if (const char* own = std::getenv("RELIEFBENCH_CACHE"); own != nullptr && *own != '\0') return own;
  if (const char* xdg = std::getenv("XDG_CACHE_HOME"); xdg != nullptr && *xdg != '\0')
    return std::filesystem::path(xdg) / "reliefbench";
  if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0')
    return std::filesystem::path(home) / ".cache" / "reliefbench";
  return std::filesystem::temp_directory_path() / "reliefbench-cache";
}

Cache Cache::open() {
  Cache cache(default_folder());
  remove_stale_temporaries(cache.folder_);
  cache.trim(kMostBytes);
  return cache;
}

std::filesystem::path Cache::file(std::string_view key) const {
  return folder_ / (sha256(key) + std::string(kExtension));
}

std::optional<std::vector<std::byte>> Cache::get(std::string_view key) const {
  const std::filesystem::path entry = file(key);
  std::error_code unreadable;
  if (!std::filesystem::is_regular_file(entry, unreadable)) return std::nullopt;
  std::ifstream in(entry, std::ios::binary);
  if (!in) return std::nullopt;
  const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (text.size() < kDigestSize) return std::nullopt;
  const std::string_view value = std::string_view(text).substr(kDigestSize);
  if (digest(key, value) != std::string_view(text).substr(0, kDigestSize)) return std::nullopt;
  std::error_code unwritable;  // then it counts as used when it was written
  std::filesystem::last_write_time(entry, std::filesystem::file_time_type::clock::now(), unwritable);
  const auto bytes = std::as_bytes(std::span(value));
  return std::vector<std::byte>(bytes.begin(), bytes.end());
}

void Cache::put(std::string_view key, std::span<const std::byte> value) const {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  const std::string_view text_of_value(reinterpret_cast<const char*>(value.data()), value.size());
  const std::string text = digest(key, text_of_value).append(text_of_value);
  try {
    write_atomically(file(key), text);
  } catch (const Error&) {
    return;  // documented: an unwritable cache only costs time
  }
}

void Cache::trim(std::uintmax_t most_bytes) const {
  struct Entry {
    std::filesystem::file_time_type used;
    std::uintmax_t bytes;
    std::filesystem::path path;
  };
  std::vector<Entry> entries;
  std::error_code gone;  // another process trims, too
  for (const auto& item : std::filesystem::directory_iterator(folder_, gone)) {
    if (!is_entry(item.path())) continue;
    const std::uintmax_t bytes = item.file_size(gone);
    if (!gone) entries.push_back({item.last_write_time(gone), bytes, item.path()});
  }
  std::ranges::sort(entries, std::greater(), &Entry::used);
  std::uintmax_t total = 0;
  for (const Entry& entry : entries) {
    total += entry.bytes;
    if (total > most_bytes) std::filesystem::remove(entry.path, gone);
  }
}

}  // namespace reliefbench
