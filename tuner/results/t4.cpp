#include "tuner/results/t4.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <ostream>

#include "kernels/base/clock.h"
#include "kernels/judge/score.h"
#include "tuner/results/budgets.h"
#include "tuner/results/json_text.h"

namespace reliefbench {
namespace {

using nlohmann::json;

json configuration_of(const TableRow& row) {
  const Settings& settings = row.settings;
  json configuration = {{"technique", settings.technique().id}, {"backend", row.backend}, {"scene", row.scene}};
  if (row.scene_key.is_known()) configuration["scene_key"] = row.scene_key.hex;
  for (const SettingValue& given : settings.written())
    configuration[std::string(given.param.id)] = given.param.choices.empty() ? json(given.value) : json(given.text());
  return configuration;
}

std::string_view invalidity_of(const TableRow& row, std::span<const Budget> constraints) {
  const auto met = [&](const Budget& budget) {
    const std::ptrdiff_t metric = &find_metric(budget.metric) - metrics().data();
    return within(row.errors[static_cast<std::size_t>(metric)], budget);
  };
  switch (row.status) {
    case Status::ok:
      return std::ranges::all_of(constraints, met) ? "correct" : "correctness";
    case Status::unsupported:
      return "constraints";
    case Status::compile_error:
      return "compile";
    case Status::timeout:
      return "timeout";
    case Status::device_lost:
    case Status::out_of_memory:
    case Status::invalid_timer:
    case Status::throttled:
    case Status::crashed:
      break;
  }
  return "runtime";
}

json measurements_of(const TableRow& row) {
  json list = json::array();
  const auto add = [&](std::string_view name, const json& value, std::string_view unit) {
    list.push_back({{"name", name}, {"value", value}, {"unit", unit}});
  };
  if (row.frame_time) {
    add("frame_time", row.frame_time->median * kMsPerNs, "ms");
    add("frame_time_ci_low", row.frame_time->ci_low * kMsPerNs, "ms");
    add("frame_time_ci_high", row.frame_time->ci_high * kMsPerNs, "ms");
  }
  for (std::size_t i = 0; i < metrics().size(); ++i)
    if (row.errors[i]) add(metrics()[i].id, *row.errors[i], metrics()[i].unit);
  add("memory", row.memory_bytes, "bytes");
  add("bake_time", row.bake_time_ns * kMsPerNs, "ms");
  if (row.device_bake_ns) add("device_bake_time", *row.device_bake_ns * kMsPerNs, "ms");
  return list;
}

json metadata_of(const Run& run) {
  const json host = run.info.value("host", json::object());
  json devices = json::object();
  for (const json& device : run.info.value("devices", json::array())) devices[device.value("backend", "")] = device;
  return {{"hardware", {{"hardware_description", json::array({host})}, {"operating_system", host.value("os", "")}}},
          {"environment",
           {{"device_query", devices},
            {"requirements",
             {"reliefbench " + run.info.value("version", "") + " (" + run.info.value("git_sha", "") + ")"}}}}};
}

json result_of(const TableRow& row, double at_ns, std::span<const Budget> constraints,
               const std::string& error_metric) {
  const std::string_view invalidity = invalidity_of(row, constraints);
  json runtimes = json::array();
  for (const double sample : row.samples_ns) runtimes.push_back(sample * kMsPerNs);
  return {{"timestamp", utc_text(at_ns)},
          {"configuration", configuration_of(row)},
          {"times",
           {{"compilation_time", row.first_draw_ns.value_or(0) * kMsPerNs},
            {"search_algorithm", 0},
            {"runtimes", runtimes}}},
          {"invalidity", invalidity},
          {"correctness", invalidity == "correct" ? 1 : 0},
          {"measurements", measurements_of(row)},
          {"objectives", {"frame_time", error_metric}}};
}

/// When a case was last timed, on the run's clock.
std::map<std::string_view, double> last_times(std::span<const Sample> samples) {
  std::map<std::string_view, double> last;
  for (const Sample& sample : samples) {
    double& at_ns = last[sample.case_id.text()];
    at_ns = std::max(at_ns, sample.at_ns);
  }
  return last;
}

}  // namespace

void write_t4(const Run& run, std::span<const TableRow> rows, std::span<const Budget> constraints, std::ostream& out) {
  const std::map<std::string_view, double> last = last_times(run.samples);
  const double started_ns = run.info.value("started_unix_ns", 0.0);
  const std::string error_metric = run.info.value(json::json_pointer("/front/error"), Config{}.front_error);
  out << "{\n\"schema_version\": \"1.0.0\",\n\"metadata\": " << json_text(metadata_of(run), 1) << ",\n\"results\": [";
  std::string_view before = "\n";
  for (const TableRow& row : rows) {
    const auto own = last.find(row.case_id);  // a case that was not timed counts as of the run's start
    const double at_ns = started_ns + (own == last.end() ? 0 : own->second);
    out << before << json_text(result_of(row, at_ns, constraints, error_metric), 1);
    before = ",\n";
  }
  out << "\n]\n}\n";
}

}  // namespace reliefbench
