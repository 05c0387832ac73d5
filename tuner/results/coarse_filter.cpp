#include "tuner/results/coarse_filter.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

#include "backends/filter_audit.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/case_table.h"
#include "tuner/results/device_json.h"

namespace reliefbench {
namespace {

std::string named_device(std::string_view name, std::string_view backend) {
  return fmt::format("{} ({})", name, backend);
}

std::string_view texels_of(const Settings& settings) { return texel_type_id(storage_of(settings).format.type); }

}  // namespace

CoarseFilter::CoarseFilter(const nlohmann::json& info, std::string_view backend) {
  const nlohmann::json device = device_of(info, backend);
  if (device.empty()) return;
  device_ = named_device(device.value("name", ""), backend);
  for (const nlohmann::json& row : device.value("filter", nlohmann::json::array()))
    if (const FilterPrecision precision = parse_filter_weights(row); precision.is_coarse())
      texels_[row.value("texels", "")] = precision.worst();
}

void CoarseFilter::add(const TableRow& row) {
  if (row.coarse_filter <= 0 || !row.settings.is("filter", "hardware")) return;
  device_ = named_device(row.device, row.backend);
  texels_[std::string(texels_of(row.settings))] = row.coarse_filter;
}

double CoarseFilter::error_of(const Settings& settings) const {
  if (texels_.empty() || !settings.is("filter", "hardware")) return 0;
  const auto found = texels_.find(texels_of(settings));
  return found == texels_.end() ? 0 : found->second;
}

std::string_view CoarseFilter::mark(std::string_view id) const {
  return !texels_.empty() && made_error_of(parse_setting(id)) ? kMark : "";
}

std::string CoarseFilter::note() const {
  if (texels_.empty()) return "";
  double worst = 0;
  std::vector<std::string_view> names;
  names.reserve(texels_.size());
  for (const auto& [texels, error] : texels_) {
    worst = std::max(worst, error);
    names.push_back(texels);
  }
  return fmt::format(
      "* filter=hardware on {}, whose sampler is off by up to {:.4f} of the difference of two {} texels, a GPU's by "
      "{:.4f}: expect less error on a GPU.",
      device_, worst, fmt::join(names, ", "), kGpuFilterError);
}

std::string_view coarse_mark(const TableRow& row) { return row.coarse_filter > 0 ? CoarseFilter::kMark : ""; }

std::set<std::string> coarse_notes(std::span<const TableRow* const> rows) {
  std::map<std::string, CoarseFilter> filters;
  for (const TableRow* row : rows) filters[named_device(row->device, row->backend)].add(*row);
  std::set<std::string> notes;
  for (const auto& [device, filter] : filters) notes.insert(filter.note());
  notes.erase("");
  return notes;
}

}  // namespace reliefbench
