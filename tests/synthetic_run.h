#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tuner/results/store.h"

namespace reliefbench {

struct SyntheticRunOptions {
  std::filesystem::path folder = "out/synthetic";
  std::string device = "Synthetic GPU";
  std::vector<std::string> backends = {"opengl", "vulkan"};
  std::vector<std::string> scenes = {"rocks/oblique", "rocks/grazing", "spikes/grazing"};
  int cases = 60;           ///< ok ones, a backend and scene
  double slowness = 1;      ///< factor on all times
  bool with_failed = true;  ///< one case of every other status besides
  std::uint32_t seed = 1;
};

/// A scene of that id, made up: no heightmap has its hash.
[[nodiscard]] MeasuredScene synthetic_scene(const std::string& id);

/// A run as a sweep leaves it, made up but shaped like real ones: slower settings err less, some settings are exact
/// (error zero, no psnr), some miss hits. The same options give the same run.
[[nodiscard]] Run synthetic_run(const SyntheticRunOptions& options);

/// What a hostile file name or driver could put into ids and reasons.
inline constexpr const char* kHostileText = R"(</script><script>alert("x")</script><!-- '&amp; \ )";

}  // namespace reliefbench
