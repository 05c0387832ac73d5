#include <nlohmann/json.hpp>

#include "kernels/base/error.h"
#include "tuner/plan/config_assets.h"
#include "tuner/tune/tune.h"

namespace reliefbench {

namespace {

/// As a config's "heightmap" has it: what is as usual is left out.
nlohmann::json heightmap_value(const HeightmapSpec& spec) {
  const HeightmapSpec usual;
  nlohmann::json value = {{"source", spec.source}};
  if (spec.channel != usual.channel) value["channel"] = spec.channel;
  if (spec.invert) value["invert"] = true;
  if (spec.normalise) value["normalise"] = true;
  if (spec.width != usual.width) value["width"] = spec.width;
  if (spec.height != usual.height) value["height"] = spec.height;
  if (spec.seed != usual.seed) value["seed"] = spec.seed;
  return value.size() > 1 ? value : nlohmann::json(spec.source);
}

}  // namespace

Config default_tune_config(const HeightmapSpec& heightmap, const std::vector<std::string>& views) {
  constexpr std::string_view kSpace = "exhaustive.json";
  nlohmann::json config =
      nlohmann::json::parse(embedded_spaces().front().text, nullptr, true, /*ignore_comments=*/true);
  nlohmann::json& scene = config.at("scenes").at(0);
  scene["heightmap"] = heightmap_value(heightmap);
  if (!views.empty()) scene["views"] = views;
  config["name"] = "tune";
  return parse_config(config.dump(1), kSpace);
}

}  // namespace reliefbench
