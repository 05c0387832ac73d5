#include "tuner/cache.h"

#include <cstdlib>
#include <fstream>
#include <string>

#include "kernels/atomic_file.h"
#include "kernels/error.h"
#include "kernels/sha256.h"
#include "tuner/store.h"

namespace reliefbench {

std::filesystem::path Cache::default_folder() {
  if (const char* own = std::getenv("RELIEFBENCH_CACHE"); own != nullptr && *own != '\0') return own;
  if (const char* xdg = std::getenv("XDG_CACHE_HOME"); xdg != nullptr && *xdg != '\0')
    return std::filesystem::path(xdg) / "reliefbench";
  if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0')
    return std::filesystem::path(home) / ".cache" / "reliefbench";
  return std::filesystem::temp_directory_path() / "reliefbench-cache";
}

std::filesystem::path Cache::file(std::string_view key) const { return folder_ / (sha256(key) + ".bin"); }

// A file is its value behind the value's own SHA-256, so that a damaged file is told from a good one.
constexpr std::size_t kDigestSize = 64;

std::optional<std::vector<std::byte>> Cache::get(std::string_view key) const {
  std::ifstream in(file(key), std::ios::binary);
  if (!in) return std::nullopt;
  const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (text.size() < kDigestSize) return std::nullopt;
  const std::string_view value = std::string_view(text).substr(kDigestSize);
  if (sha256(value) != text.substr(0, kDigestSize)) return std::nullopt;
  const auto bytes = std::as_bytes(std::span(value));
  return std::vector<std::byte>(bytes.begin(), bytes.end());
}

void Cache::put(std::string_view key, std::span<const std::byte> value) const {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  std::string text = sha256(value);
  text.append(reinterpret_cast<const char*>(value.data()), value.size());
  try {
    write_atomically(file(key), text);
  } catch (const Error&) {
    return;  // documented: an unwritable cache only costs time
  }
}

}  // namespace reliefbench
