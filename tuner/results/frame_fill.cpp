#include "tuner/results/frame_fill.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "kernels/base/error.h"
#include "tuner/results/run_files.h"

namespace reliefbench {
namespace {

FrameFill parse_fill(const nlohmann::json& entry) {
  try {
    return {.width_px = entry.at("frame_px").at(0).get<int>(),
            .height_px = entry.at("frame_px").at(1).get<int>(),
            .pixel_cost = entry.at("pixel_cost").get<double>()};
  } catch (const nlohmann::json::exception&) {
    fail_input("{}: key 'devices': an entry of 'frame_fill' is not {{\"frame_px\": [w, h], \"pixel_cost\": number}}",
               kRunFile);
  }
}

}  // namespace

nlohmann::json fills_json(std::span<const FrameFill> fills) {
  nlohmann::json json = nlohmann::json::array();
  for (const FrameFill& fill : fills)
    json.push_back({{"frame_px", {fill.width_px, fill.height_px}}, {"pixel_cost", fill.pixel_cost}});
  return json;
}

std::vector<std::string> small_frame_notes(const nlohmann::json& info) {
  std::vector<std::string> notes;
  for (const nlohmann::json& device : info.value("devices", nlohmann::json::array()))
    for (const nlohmann::json& entry : device.value("frame_fill", nlohmann::json::array())) {
      const FrameFill fill = parse_fill(entry);
      if (!fill.is_too_small()) continue;
      notes.push_back(fmt::format(
          "frames of {}x{} do not fill {} ({}): a pixel costs {:.2f} times what it costs in twice the size. Where more "
          "is drawn, techniques may rank otherwise: set frame_px",
          fill.width_px, fill.height_px, device.value("name", ""), device.value("backend", ""), fill.pixel_cost));
    }
  return notes;
}

}  // namespace reliefbench
