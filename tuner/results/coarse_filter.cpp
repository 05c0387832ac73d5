#include "tuner/results/coarse_filter.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "backends/filter_audit.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/device_json.h"

namespace reliefbench {

CoarseFilter::CoarseFilter(const nlohmann::json& info, std::string_view backend) {
  const nlohmann::json device = device_of(info, backend);
  if (device.empty()) return;
  device_ = fmt::format("{} ({})", device.value("name", ""), backend);
  for (const nlohmann::json& row : device.value("filter", nlohmann::json::array())) {
    const FilterPrecision precision = parse_filter_weights(row);
    if (!precision.is_coarse()) continue;
    texels_.push_back(row.value("texels", ""));
    worst_ = std::max(worst_, precision.worst());
  }
}

bool CoarseFilter::made_error_of(const Settings& settings) const {
  return settings.is("filter", "hardware") &&
         std::ranges::find(texels_, texel_type_id(storage_of(settings).format.type)) != texels_.end();
}

std::string_view CoarseFilter::mark(std::string_view id) const {
  return !texels_.empty() && made_error_of(parse_setting(id)) ? kMark : "";
}

std::string CoarseFilter::note() const {
  if (texels_.empty()) return "";
  return fmt::format(
      "* filter=hardware on {}, whose sampler is off by up to {:.4f} of the difference of two {} texels, a GPU's by "
      "{:.4f}: expect less error on a GPU.",
      device_, worst_, fmt::join(texels_, ", "), kGpuFilterError);
}

}  // namespace reliefbench
