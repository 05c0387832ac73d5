#include "reports/pages/require_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "kernels/base/atomic_file.h"
#include "kernels/base/folder_lock.h"
#include "kernels/image/image.h"
#include "reports/pages/data_uri.h"
#include "reports/pages/report_data.h"
#include "reports/pages/template.h"
#include "tuner/results/json_text.h"
#include "tuner/results/run_files.h"
#include "tuner/results/run_folder.h"

namespace reliefbench {
namespace {

/// A picture in its folder, and in the page.
nlohmann::json write_picture(const std::filesystem::path& file, const Scene& scene,
                             std::span<const std::uint8_t> rgba8) {
  if (rgba8.empty()) return nullptr;
  write_png(file, scene.width_px, scene.height_px, rgba8);
  return webp_uri(scene.width_px, scene.height_px, rgba8);
}

constexpr int kSheetGap_px = 4;

/// All pictures as one, a row a feature in the report's order: without it, with it, the reference. What a README shows.
void write_sheet(const std::filesystem::path& file, const RequireReport& report) {
  std::vector<const FeatureWorth*> rows;
  for (const FeatureWorth& worth : report.worth)
    if (!worth.pictures.without.empty()) rows.push_back(&worth);
  if (rows.empty()) return;
  const auto scene_of = [&](const FeatureWorth& worth) -> const Scene& {
    return report.file.scenes[report.at(worth.without).view].scene;
  };
  int cell_width = 0;
  int cell_height = 0;
  for (const FeatureWorth* worth : rows) {
    cell_width = std::max(cell_width, scene_of(*worth).width_px);
    cell_height = std::max(cell_height, scene_of(*worth).height_px);
  }
  const int width = 3 * cell_width + 2 * kSheetGap_px;
  const int height = static_cast<int>(rows.size()) * (cell_height + kSheetGap_px) - kSheetGap_px;
  std::vector<std::uint8_t> sheet(4 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 255);
  int top = 0;
  for (const FeatureWorth* worth : rows) {
    const Scene& scene = scene_of(*worth);
    const auto row_bytes = 4 * static_cast<std::ptrdiff_t>(scene.width_px);
    int left = 0;
    for (const auto* picture : {&worth->pictures.without, &worth->pictures.with, &worth->pictures.reference}) {
      for (int y = 0; y < scene.height_px; ++y)
        std::copy_n(picture->begin() + y * row_bytes, row_bytes,
                    sheet.begin() + 4 * (static_cast<std::ptrdiff_t>(top + y) * width + left));
      left += cell_width + kSheetGap_px;
    }
    top += cell_height + kSheetGap_px;
  }
  const std::vector<std::uint8_t> webp = encode_webp(width, height, sheet);
  write_output(file, std::string_view(reinterpret_cast<const char*>(webp.data()), webp.size()));
}

}  // namespace

void write_require(const RequireReport& report, const std::filesystem::path& folder) {
  make_images_folder(folder);
  const FolderLock lock(folder);
  nlohmann::json data = require_json(report);
  write_output(folder / kRequireFile, json_text(data, 1) + "\n");
  for (std::size_t i = 0; i < report.worth.size(); ++i) {
    const FeatureWorth& worth = report.worth[i];
    const Scene& scene = report.file.scenes[report.at(worth.without).view].scene;
    const auto picture = [&](const char* kind, std::span<const std::uint8_t> rgba8) {
      return write_picture(folder / kImagesFolder / fmt::format("{}-{}.png", worth.name, kind), scene, rgba8);
    };
    data["features"][i]["pictures"] = {{"without", picture("without", worth.pictures.without)},
                                       {"with", picture("with", worth.pictures.with)},
                                       {"reference", picture("reference", worth.pictures.reference)}};
  }
  const auto add_name = [](nlohmann::json& told) {
    told.update(setting_name_json(told.at("setting").get<std::string>()));
  };
  add_name(data["answer"]);
  if (data.contains("failed")) std::ranges::for_each(data["failed"], add_name);
  write_sheet(folder / kImagesFolder / kSheetFile, report);
  write_output(folder / kRequirePage, fill_page(kRequirePage, data));
}

}  // namespace reliefbench
