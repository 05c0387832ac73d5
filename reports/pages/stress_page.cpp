#include "reports/pages/stress_page.h"

#include <nlohmann/json.hpp>
#include <string>

#include "kernels/base/atomic_file.h"
#include "kernels/base/error.h"
#include "kernels/base/json_file.h"
#include "kernels/image/image.h"
#include "reports/pages/data_uri.h"
#include "reports/pages/report_data.h"
#include "reports/pages/template.h"
#include "tuner/results/json_text.h"
#include "tuner/results/run_files.h"
#include "tuner/results/run_folder.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// Relative to the folder.
fs::path picture_path(const std::string& technique) { return kImagesFolder / fs::path(technique + ".png"); }

json parse_stress(const fs::path& path) {
  json stress = read_json(path);
  const json schema = stress.is_object() ? stress.value("schema", json()) : json();
  if (schema != kStressSchema)
    fail_input("{}: key 'schema': is {}, this reliefbench reads {}", path.string(),
               schema.is_null() ? "missing" : schema.dump(), kStressSchema);
  return stress;
}

json pictures_of(const json& stress, const fs::path& folder) {
  json pictures = json::object();
  for (const json& worst : stress.at("worst")) {
    const auto technique = worst.at("technique").get<std::string>();
    const auto picture = png_data_uri(folder, picture_path(technique));
    pictures[technique] = picture ? json(*picture) : json();
  }
  return pictures;
}

/// Results get {name, key} of their settings; what another version drew may be unknown, and has none.
void add_names(json& results) {
  for (json& result : results) try {
      const auto text = [&](const char* key) { return result.at(key).get<std::string>(); };
      result.update(setting_name_json(text("technique") + "?" + text("settings")));
    } catch (const Error&) {
      continue;
    }
}

}  // namespace

FolderLock prepare_stress_folder(const fs::path& folder) {
  make_images_folder(folder);
  FolderLock lock(folder);
  remove_stale_run_files(folder);
  return lock;
}

void write_stress(const StressReport& report, const fs::path& folder) {
  write_atomically(folder / kStressFile, json_text(stress_json(report), 1) + "\n");
  for (const StressPicture& picture : report.pictures)
    write_png(folder / picture_path(picture.technique), picture.width, picture.height, picture.rgba8);
  write_stress_page(folder, folder / kStressPage);
}

bool is_stress_folder(const fs::path& folder) {
  std::error_code error;
  return fs::exists(folder / kStressFile, error) && !fs::exists(folder / kRunFile, error);
}

json load_stress(const fs::path& folder) {
  const fs::path path = folder / kStressFile;
  json stress = parse_stress(path);
  try {
    stress["pictures"] = pictures_of(stress, folder);
    add_names(stress.at("results"));
  } catch (const json::exception& error) {
    fail_input("{}: not as `reliefbench stress` writes it: {}", path.string(), error.what());
  }
  return stress;
}

void write_stress_page(const fs::path& folder, const fs::path& output) {
  json data = empty_report_data().data;
  data["stress"] = load_stress(folder);
  write_output(output, fill_page(kReportFile, data));
}

}  // namespace reliefbench
