#include "tuner/results/case_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "kernels/base/error.h"
#include "tuner/plan/case.h"
#include "tuner/results/coarse_filter.h"
#include "tuner/results/device_json.h"
#include "tuner/results/relative_time.h"

namespace reliefbench {
namespace {

std::vector<double> corrected_samples_ns(const Run& run, const SamplesByCase& samples, const Record& record) {
  const auto own = samples.find(record.case_id);
  const auto control = samples.find(control_case_id(record.backend));
  const double reference_ns = control_reference_ns(run.info, record.backend);
  if (own == samples.end() || control == samples.end() || reference_ns <= 0) return {};
  return corrected_times_ns(own->second, control->second, reference_ns);
}

}  // namespace

MeasuredDevice measured_device(const TableRow& row) {
  return {.backend = row.backend, .device = row.device, .driver = row.driver, .machine = row.machine};
}

std::optional<double> ns_per_px(const Run& run, const Record& record) {
  const auto scene = std::ranges::find(run.scenes, record.scene_key, [](const MeasuredScene& one) { return one.key; });
  if (scene == run.scenes.end() || !record.frame_time) return std::nullopt;
  const Scene& frame = scene->spec.scene;
  return record.frame_time->summary.median / (static_cast<double>(frame.width_px) * frame.height_px);
}

std::vector<TableRow> case_table(const Run& run) {
  const SamplesByCase samples = group_samples(run.samples);
  std::map<std::pair<std::string, std::string>, MeasuredDevice> devices;
  std::map<std::string, CoarseFilter> filters;  // by backend
  std::vector<TableRow> rows;
  rows.reserve(run.records.size());
  for (const Record& record : run.records) {
    const auto [device, is_new] = devices.try_emplace({record.backend, record.device});
    if (is_new) device->second = measured_device(run.info, record.backend, record.device);
    TableRow row{.case_id = record.case_id,
                 .settings = settings_of(record.technique, record.params),
                 .map = record.map,
                 .backend = record.backend,
                 .device = record.device,
                 .driver = device->second.driver,
                 .machine = device->second.machine,
                 .scene = record.scene,
                 .scene_key = record.scene_key,
                 .status = record.status,
                 .reason = record.reason,
                 .errors = std::vector<std::optional<double>>(metrics().size()),
                 .memory_bytes = record.memory_bytes,
                 .bake_time_ns = record.bake_time_ns,
                 .device_bake_ns = record.device_bake_ns,
                 .first_draw_ns = record.first_draw_ns,
                 .frame_time = std::nullopt,
                 .ns_per_px = ns_per_px(run, record),
                 .samples_ns = corrected_samples_ns(run, samples, record)};
    row.coarse_filter =
        filters.try_emplace(record.backend, run.info, record.backend).first->second.error_of(row.settings);
    if (record.frame_time) row.frame_time = record.frame_time->summary;
    if (record.error)
      std::ranges::transform(metrics(), row.errors.begin(),
                             [&](const MetricRow& metric) { return metric.value(*record.error); });
    rows.push_back(std::move(row));
  }
  return rows;
}

std::vector<TableRow> load_case_table(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_regular_file(path, ignored)) return parse_case_table(read_file(path), path.string());
  return case_table(load_run(path));
}

}  // namespace reliefbench
