#include "tuner/results/run_files.h"

#include <fmt/format.h>

#include "kernels/base/sha256.h"

namespace reliefbench {

std::filesystem::path image_path(std::string_view key, std::string_view kind) {
  return std::filesystem::path("images") / fmt::format("{}-{}.png", sha256(key).substr(0, 16), kind);
}

std::string reference_image_key(std::string_view scene, std::string_view backend) {
  return fmt::format("reference@{}?backend={}", scene, backend);
}

}  // namespace reliefbench
