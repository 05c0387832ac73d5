#include <nlohmann/json.hpp>

#include "kernels/base/error.h"
#include "tuner/plan/config_assets.h"
#include "tuner/tune/tune.h"

namespace reliefbench {

Config default_tune_config(const std::string& heightmap, const std::vector<std::string>& views) {
  constexpr std::string_view kSpace = "exhaustive.json";
  nlohmann::json config =
      nlohmann::json::parse(embedded_spaces().front().text, nullptr, true, /*ignore_comments=*/true);
  nlohmann::json& scene = config.at("scenes").at(0);
  scene["heightmap"] = heightmap;
  if (!views.empty()) scene["views"] = views;
  config["name"] = "tune";
  return parse_config(config.dump(1), kSpace);
}

}  // namespace reliefbench
