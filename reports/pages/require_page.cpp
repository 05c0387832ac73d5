#include "reports/pages/require_page.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <span>
#include <utility>

#include "kernels/base/atomic_file.h"
#include "kernels/image/image.h"
#include "reports/pages/data_uri.h"
#include "reports/pages/template.h"
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

}  // namespace

void write_require(const RequireReport& report, const std::filesystem::path& folder) {
  make_images_folder(folder);
  nlohmann::json data = require_json(report);
  write_output(folder / kRequireFile, data.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
  for (std::size_t i = 0; i < report.worth.size(); ++i) {
    const FeatureWorth& worth = report.worth[i];
    const Scene& scene = report.file->scenes[report.at(worth.without).view].scene;
    const auto picture = [&](const char* kind, std::span<const std::uint8_t> rgba8) {
      return write_picture(folder / kImagesFolder / fmt::format("{}-{}.png", worth.name, kind), scene, rgba8);
    };
    data["features"][i]["pictures"] = {{"without", picture("without", worth.pictures.without)},
                                       {"with", picture("with", worth.pictures.with)},
                                       {"reference", picture("reference", worth.pictures.reference)}};
  }
  write_output(folder / kRequirePage, fill_page(kRequirePage, data));
}

}  // namespace reliefbench
