#include "reports/stress_page.h"

#include <nlohmann/json.hpp>

#include "kernels/atomic_file.h"
#include "kernels/error.h"
#include "kernels/image.h"
#include "reports/data_uri.h"
#include "reports/template.h"

namespace reliefbench {

void prepare_stress_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder / "images", error);
  if (error) fail_input("{}: cannot be made: {}", folder.string(), error.message());
}

void write_stress(const StressReport& report, const std::filesystem::path& folder) {
  nlohmann::json data = stress_json(report);
  write_atomically(folder / "stress.json", data.dump(1) + "\n");
  for (const StressPicture& picture : report.pictures) {
    const std::filesystem::path path = folder / "images" / (picture.technique + ".png");
    write_png(path, picture.width, picture.height, picture.rgba8);
    data["pictures"][picture.technique] = png_data_uri(path).value_or("");
  }
  write_atomically(folder / "stress.html", fill_page("stress.html", data));
}

}  // namespace reliefbench
