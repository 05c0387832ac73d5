#include "tuner/history/ingest.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "kernels/base/append_file.h"
#include "kernels/base/error.h"
#include "kernels/base/sha256.h"
#include "tuner/history/google_benchmark.h"
#include "tuner/history/moment.h"
#include "tuner/history/series_name.h"
#include "tuner/history/standard_error.h"
#include "tuner/results/host.h"
#include "tuner/results/relative_time.h"
#include "tuner/results/run_files.h"
#include "tuner/results/run_parts.h"
#include "tuner/results/store.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

json member_of(const json& object, const char* key, const json& otherwise) {
  const auto found = object.find(key);
  return found == object.end() ? otherwise : *found;
}

json devices_of(const Run& run) { return member_of(run.info, "devices", json::array()); }

/// What would change times by itself. Memory to a GiB, since what the kernel keeps of it varies. Not the timers: which
/// one passes its audit may change from night to night, and a case and its control case are timed by the same.
json environment_of(const Run& run) {
  json environment = {{"devices", json::array()}};
  json host = member_of(run.info, "host", json::object());
  host.erase("name");
  if (const json bytes = member_of(host, "memory_bytes", nullptr); bytes.is_number()) {
    host.erase("memory_bytes");
    const double gib = bytes.get<double>() / (1U << 30U);
    constexpr double kMostGib = 1e9;
    if (std::abs(gib) < kMostGib) host["memory_gib"] = std::llround(gib);
  }
  environment["host"] = host;
  for (const json& device : devices_of(run)) {
    json& kept = environment["devices"].emplace_back(json::object());
    for (const char* key : {"backend", "name", "vendor", "type", "driver", "api_version"})
      if (device.contains(key)) kept[key] = device[key];
  }
  return environment;
}

json health_of(const Run& run) {
  json devices = json::array();
  for (const json& device : devices_of(run)) {
    json& kept = devices.emplace_back(json::object());
    for (const char* key : {"backend", "name", "timer", "audit", "filter"})
      if (device.contains(key)) kept[key] = device[key];
  }
  return {{"devices", devices}};
}

/// Backends whose timer passed its audit.
std::set<std::string> believed_backends(const Run& run) {
  std::set<std::string> believed;
  for (const json& device : devices_of(run)) {
    const json timer = member_of(device, "timer", nullptr);
    for (const json& row : member_of(device, "audit", json::array()))
      if (row.is_object() && member_of(row, "timer", false) == timer && member_of(row, "valid", false) == true)
        believed.insert(member_of(device, "backend", "").get<std::string>());
  }
  return believed;
}

std::vector<CalibrationRow> calibrations_of(const Run& run, const SamplesByCase& samples) {
  std::vector<CalibrationRow> rows;
  for (const json& device : devices_of(run)) {
    const std::string backend = member_of(device, "backend", "").get<std::string>();
    const auto control = samples.find(control_case_id(backend));
    if (control == samples.end()) continue;
    const Summary summary = summarise(control_times_ns(run.info, backend, control->second));
    rows.push_back({.device = device_name(backend, member_of(device, "name", "").get<std::string>()),
                    .control_ns = summary.median,
                    .mad = summary.mad,
                    .n = summary.n});
  }
  return rows;
}

/// All that is deterministic of a case. A metric whose pictures were the same is null; one that nobody looked at is not
/// there.
std::string score_text(const Record& record) {
  json values = {{"memory_bytes", record.memory_bytes}};
  for (const MetricRow& row : metrics()) {
    const std::optional<double> value = row.value(*record.error);
    if (value || row.none_is_best()) values[std::string(row.id)] = value ? json(*value) : json();
  }
  return values.dump();
}

SeriesRow series_of(const Record& record, const std::string& machine) {
  const auto format = std::ranges::find(record.params, "format", &std::pair<std::string, std::string>::first);
  return {.machine = machine,
          .setting = match_key(record),
          .case_id = record.case_id,
          .scene = record.scene,
          .scene_key = record.scene_key.hex,
          .technique = record.technique,
          .map = record.map,
          .format = format == record.params.end() ? "" : format->second,
          .backend = record.backend,
          .device = device_name(record.backend, record.device),
          .metric = "frame_time",
          .unit = "ns"};
}

/// A case's times, as far as there are samples. relative: filled in for its standard error
RepetitionRow repetition_of(const Record& record, const SamplesByCase& samples, bool is_believed,
                            RobustMedian& relative) {
  RepetitionRow row;
  row.is_valid = false;
  row.status = status_id(record.status);
  row.code = record.timing_key;
  const auto own = samples.find(record.case_id);
  if (own == samples.end()) return row;
  row.samples = raw_times(own->second);
  const Summary raw = summarise(row.samples);
  row.median = raw.median;
  row.mad = raw.mad;
  row.n = raw.n;
  const auto control = samples.find(control_case_id(record.backend));
  if (control == samples.end()) return row;
  const Summary summary = summarise(relative_times(own->second, control->second));
  if (!std::isfinite(summary.median) || !std::isfinite(summary.mad)) return row;
  row.value = summary.median;
  row.is_valid = record.status == Status::ok && is_believed && row.value > 0;
  if (row.is_valid) relative = {.median = summary.median, .mad = summary.mad, .n = summary.n};
  return row;
}

/// The cases of a device, whose times scatter alike.
struct DeviceTimes {
  std::vector<std::size_t> places;  ///< in Night::values
  std::vector<RobustMedian> relative;
};

void add_values(const Run& run, const SamplesByCase& samples, Night& night) {
  const std::set<std::string> believed = believed_backends(run);
  std::set<std::pair<std::string, std::string>> seen;
  std::map<std::string, DeviceTimes> devices;
  for (const Record& record : run.records) {
    SeriesRow series = series_of(record, night.run.machine);
    if (!seen.emplace(series.setting, series.device).second) {
      night.skipped.push_back(fmt::format("{}: the same setting and scene as an earlier case", record.case_id));
      continue;
    }
    if (record.status == Status::ok && !samples.contains(record.case_id)) {
      night.skipped.push_back(fmt::format("{}: has no samples", record.case_id));
      continue;
    }
    DeviceTimes& device = devices[series.device];
    device.places.push_back(night.values.size());
    RepetitionRow row =
        repetition_of(record, samples, believed.contains(record.backend), device.relative.emplace_back());
    night.values.push_back({.series = std::move(series),
                            .row = std::move(row),
                            .score = record.error ? std::optional(score_text(record)) : std::nullopt});
  }
  for (const auto& [name, device] : devices) {
    const std::vector<double> errors = moderated_errors(device.relative);
    for (std::size_t i = 0; i < errors.size(); ++i) night.values[device.places[i]].row.standard_error = errors[i];
  }
}

/// The first line of a file, or what there is of it.
std::string_view first_line(std::string_view text) { return text.substr(0, text.find('\n')); }

Night read_run(const fs::path& folder) {
  const Run run = load_run(folder);
  if (run.info["identity"].contains("replay"))
    fail_input("{}: its tune searched a recorded run and measured nothing", folder.string());
  if (!member_of(run.info, "finished", nullptr).is_string())
    fail_input("{}: key 'finished': the run is not finished; {}", (folder / kRunFile).string(), how_to_finish(run));
  const json started_ns = member_of(run.info, "started_unix_ns", nullptr);
  const std::string identity =
      run.info["identity"].dump() + started_ns.dump() + member_of(run.info, "started", "").dump();
  const std::string results = read_file(folder / kResultsFile);
  const std::string samples = fs::exists(folder / kSamplesFile) ? read_file(folder / kSamplesFile) : "";
  Night night;
  night.origin = sha256(fmt::format("{}\n{}", identity, first_line(samples)));
  night.run.content = sha256(fmt::format("{}\n{}\n{}", identity, sha256(results), sha256(samples)));
  night.parts = part_keys(run.info);
  night.run.kind = "reliefbench";
  night.run.machine = member_of(member_of(run.info, "host", json::object()), "name", host_name()).get<std::string>();
  night.run.unix_s = started_ns.is_number() ? static_cast<std::int64_t>(started_ns.get<double>() / 1e9)
                                            : parse_moment(member_of(run.info, "started", "").get<std::string>(),
                                                           (folder / kRunFile).string() + ": key 'started'");
  night.run.build.commit = member_of(run.info, "git_sha", "unknown").get<std::string>();
  night.run.health = health_of(run);
  night.environment = environment_of(run);
  const SamplesByCase by_case = group_samples(run.samples);
  night.run.calibrations = calibrations_of(run, by_case);
  add_values(run, by_case, night);
  return night;
}

}  // namespace

Night read_night(const fs::path& path, const NightLabels& labels) {
  std::error_code error;
  const bool is_folder = fs::is_directory(path, error);
  if (is_folder && !fs::exists(path / kRunFile, error))
    fail_input("{}: is no run of sweep or tune: it has no {}", path.string(), kRunFile);
  Night night = is_folder ? read_run(path) : read_google_benchmark(path, labels.unix_s);
  night.run.source = path.string();
  if (labels.machine) {
    night.run.machine = *labels.machine;
    for (Night::Value& value : night.values) value.series.machine = *labels.machine;
  }
  if (labels.commit) night.run.build.commit = *labels.commit;
  if (labels.parent) night.run.build.parent = *labels.parent;
  if (labels.unix_s) night.run.unix_s = *labels.unix_s;
  // "0123abcd-dirty", as `git describe --dirty` and `git_sha` of a changed checkout have it
  std::string& commit = night.run.build.commit;
  constexpr std::string_view kDirty = "-dirty";
  if (commit.ends_with(kDirty)) {
    night.run.build.is_dirty = true;
    commit.resize(commit.size() - kDirty.size());
  }
  if (commit.empty()) commit = "unknown";
  return night;
}

}  // namespace reliefbench
