#include "tuner/results/run_files.h"

#include <fmt/format.h>

#include "kernels/base/sha256.h"
#include "kernels/trace/feature.h"

namespace reliefbench {
namespace {

constexpr std::size_t kImageDigits = 16;

}  // namespace

std::filesystem::path image_path(std::string_view key, std::string_view kind) {
  return kImagesFolder / std::filesystem::path(fmt::format("{}-{}.png", sha256(key).substr(0, kImageDigits), kind));
}

bool is_image_name(std::string_view file_name) {
  if (file_name.find_first_not_of("0123456789abcdef") != kImageDigits) return false;
  const std::string_view rest = file_name.substr(kImageDigits);
  return rest == "-frame.png" || rest == "-error.png" || rest == "-taps.png";
}

std::string reference_image_key(std::string_view scene, std::string_view backend, std::string_view case_id) {
  std::string key = fmt::format("reference@{}?backend={}", scene, backend);
  for (const Feature& feature : all_features())  // ids have those that are on, and no other
    if (feature.value && case_id.find(fmt::format("&{}=", feature.id)) != std::string_view::npos)
      key += fmt::format("&{}=exact", feature.id);
  return key;
}

}  // namespace reliefbench
