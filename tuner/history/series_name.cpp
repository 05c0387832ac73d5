#include "tuner/history/series_name.h"

#include <fmt/format.h>

#include "kernels/base/error.h"
#include "tuner/plan/setting_names.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {

std::string series_name(const SeriesRow& series) {
  const std::string setting = series_setting_name(series);
  return setting == series.case_id ? setting : fmt::format("{} in {}, {}", setting, series.scene, series.backend);
}

std::string series_setting_name(const SeriesRow& series) {
  if (series.scene_key.empty()) return series.case_id;
  try {
    return named(parse_case(series.case_id).settings);
  } catch (const Error&) {  // of a build whose rows had other names
    return series.case_id;
  }
}

}  // namespace reliefbench
