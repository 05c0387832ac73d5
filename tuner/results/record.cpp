#include "tuner/results/record.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <new>
#include <nlohmann/json.hpp>

#include "backends/worker/worker.h"
#include "kernels/base/file_error.h"

namespace reliefbench {
namespace {

using nlohmann::json;

// In the order of Status.
constexpr std::array<std::string_view, 9> kStatusIds{"ok",          "unsupported",   "compile_error", "timeout",
                                                     "device_lost", "out_of_memory", "invalid_timer", "throttled",
                                                     "crashed"};

/// JSON has no NaN and no infinity, and the library would write `null` for them without a word.
/// returns: the document (a json under construction would leak if to_json threw once it holds something)
json checked(json document) {
  const json flat = document.flatten();
  for (const auto& [key, value] : flat.items())
    if (value.is_number_float() && !std::isfinite(value.get<double>()))
      fail_input("'{}' is {}, which no file may hold", key, value.get<double>());
  return document;
}

const json& member(const json& object, const char* key) {
  if (!object.is_object()) fail_input("expected an object that holds '{}'", key);
  const auto found = object.find(key);
  if (found == object.end()) fail_input("'{}' is missing", key);
  return *found;
}

double number(const json& object, const char* key) {
  const json& value = member(object, key);
  if (!value.is_number()) fail_input("'{}' is not a number", key);
  return value.get<double>();
}

template <typename Integer>
Integer integer(const json& object, const char* key) {
  const json& value = member(object, key);
  if (!value.is_number_integer()) fail_input("'{}' is not an integer", key);
  return value.get<Integer>();
}

std::string text(const json& object, const char* key) {
  const json& value = member(object, key);
  if (!value.is_string()) fail_input("'{}' is not a string", key);
  return value.get<std::string>();
}

/// The member, or null where it is absent or null.
const json* optional_member(const json& object, const char* key) {
  const auto found = object.find(key);
  return found == object.end() || found->is_null() ? nullptr : &*found;
}

/// null where the frame has no value, and it is written; absent of a feature of the scene that the frame has not.
json score_json(const FrameScore& score) {
  json out = {{"pixels", score.pixels}};
  for (const MetricRow& row : metrics()) {
    const std::optional<double> value = row.value(score);
    if (!value && !row.metric->feature.empty()) continue;
    json& member = out[std::string(row.metric->id)];
    (row.part.empty() ? member : member[std::string(row.part)]) = value ? json(*value) : json();
  }
  return out;
}

std::optional<double> parse_value(const json& j, const MetricRow& row) {
  const std::string metric(row.metric->id);
  const std::string part(row.part);
  const NoValue no_value = row.metric->no_value;
  if (no_value == NoValue::unmeasured && optional_member(j, metric.c_str()) == nullptr) return std::nullopt;
  const json& object = part.empty() ? j : member(j, metric.c_str());
  const char* key = part.empty() ? metric.c_str() : part.c_str();
  if (no_value != NoValue::never && member(object, key).is_null()) return std::nullopt;
  return number(object, key);
}

FrameScore parse_score(const json& j) {
  FrameScore score{.pixels = integer<std::int64_t>(j, "pixels")};
  for (const MetricRow& row : metrics()) score.values.at(row.place) = parse_value(j, row);
  return score;
}

json frame_time_json(const FrameTime& time) {
  json j = summary_json(time.summary);
  j["raw_median"] = time.raw_median;
  j["timer"] = time.timer;
  return j;
}

/// A time, or another quantity that ratios are made of.
double positive(const json& object, const char* key) {
  const double value = number(object, key);
  if (!(std::isfinite(value) && value > 0)) fail_input("'{}' is {}, expected a number above 0", key, value);
  return value;
}

FrameTime parse_frame_time(const json& j) {
  FrameTime time{.summary = {.median = positive(j, "median"),
                             .mad = number(j, "mad"),
                             .ci_low = positive(j, "ci_low"),
                             .ci_high = positive(j, "ci_high"),
                             .n = integer<int>(j, "n")},
                 .raw_median = positive(j, "raw_median"),
                 .timer = text(j, "timer")};
  if (time.summary.n < 1) fail_input("'n' is {}, expected at least 1", time.summary.n);
  if (time.summary.ci_low > time.summary.ci_high)
    fail_input("'ci_low' is {}, above 'ci_high', {}", time.summary.ci_low, time.summary.ci_high);
  return time;
}

/// The id has "backend=..." (Case::id()), and samples are found by both.
void check_backend(const Record& record) {
  constexpr std::string_view kKey = "backend=";
  const std::size_t key = record.case_id.rfind(kKey);
  if (key == std::string::npos) return;
  std::string_view named = std::string_view(record.case_id).substr(key + kKey.size());
  named = named.substr(0, named.find('&'));
  if (named != record.backend) fail_input("'backend' is '{}', but the case's id says '{}'", record.backend, named);
}

/// JSON objects have no order; the case id has it: "...?linear_steps=16&refinement=none&backend=...".
std::vector<std::pair<std::string, std::string>> parse_params(const json& j, std::string_view case_id) {
  if (!j.is_object()) fail_input("'params' is not an object");
  std::vector<std::pair<std::string, std::string>> params;
  for (const auto& item : j.items()) params.emplace_back(item.key(), text(j, item.key().c_str()));
  const auto place = [case_id](const auto& param) {
    return std::min(case_id.find("?" + param.first + "="), case_id.find("&" + param.first + "="));
  };
  std::ranges::stable_sort(params, {}, place);
  return params;
}

Status status_of(Fault fault, Status otherwise) {
  switch (fault) {
    case Fault::device_lost:
      return Status::device_lost;
    case Fault::timeout:
      return Status::timeout;
    case Fault::out_of_memory:
      return Status::out_of_memory;
    case Fault::invalid_timer:
      return Status::invalid_timer;
    case Fault::other:
      break;
  }
  return otherwise;
}

}  // namespace

bool may_pass(Status status) {
  return status == Status::timeout || status == Status::device_lost || status == Status::out_of_memory ||
         status == Status::throttled || status == Status::crashed;
}

void enter_failure(Record& record, Status otherwise) {
  try {
    throw;
  } catch (const FileError&) {  // a full disk ends the run: it says nothing about the case
    throw;
  } catch (const WorkerCrashed& crash) {
    record.status = Status::crashed;
    record.reason = crash.what();
  } catch (const Error& error) {
    record.status = status_of(error.fault(), otherwise);
    record.reason = error.what();
  } catch (const std::bad_alloc&) {
    record.status = Status::out_of_memory;
    record.reason = "the host's memory is used up";
  }
}

std::string_view status_id(Status status) { return kStatusIds.at(static_cast<std::size_t>(status)); }

Status parse_status(std::string_view id) {
  const auto* const found = std::ranges::find(kStatusIds, id);
  if (found == kStatusIds.end()) fail_input("unknown status '{}'", id);
  return static_cast<Status>(found - kStatusIds.begin());
}

void to_json(json& j, const Record& record) {
  json params = json::object();
  for (const auto& [id, value] : record.params) params[id] = value;
  json line = {{"schema", kSchemaVersion},
               {"case", record.case_id},
               {"technique", record.technique},
               {"params", std::move(params)},
               {"map", record.map},
               {"scene", record.scene},
               {"scene_key", record.scene_key.hex},
               {"backend", record.backend},
               {"device", record.device},
               {"status", status_id(record.status)},
               {"memory_bytes", record.memory_bytes},
               {"bake_time_ns", record.bake_time_ns},
               {"timing_key", record.timing_key},
               {"bake_key", record.bake_key},
               {"reference_key", record.reference_key}};
  if (record.device_bake_ns) line["device_bake_ns"] = *record.device_bake_ns;
  if (record.first_draw_ns) line["first_draw_ns"] = *record.first_draw_ns;
  if (!record.reason.empty()) line["reason"] = record.reason;
  if (record.frame_time) line["frame_time_ns"] = frame_time_json(*record.frame_time);
  if (record.error) line["error"] = score_json(*record.error);
  j = checked(std::move(line));
}

void from_json(const json& j, Record& record) {
  if (const int schema = integer<int>(j, "schema"); schema != kSchemaVersion)
    fail_input("'schema' is {}, this reliefbench reads {}", schema, kSchemaVersion);
  record = {.case_id = text(j, "case"),
            .technique = text(j, "technique"),
            .params = parse_params(member(j, "params"), text(j, "case")),
            .map = text(j, "map"),
            .scene = text(j, "scene"),
            .scene_key = parse_scene_key(text(j, "scene_key")),
            .backend = text(j, "backend"),
            .device = text(j, "device"),
            .status = parse_status(text(j, "status")),
            .reason = optional_member(j, "reason") != nullptr ? text(j, "reason") : "",
            .frame_time = std::nullopt,
            .error = std::nullopt,
            .memory_bytes = integer<std::int64_t>(j, "memory_bytes"),
            .bake_time_ns = number(j, "bake_time_ns"),
            .device_bake_ns = std::nullopt,
            .first_draw_ns = std::nullopt,
            .timing_key = text(j, "timing_key"),
            .bake_key = text(j, "bake_key"),
            .reference_key = text(j, "reference_key")};
  if (optional_member(j, "device_bake_ns") != nullptr) record.device_bake_ns = positive(j, "device_bake_ns");
  if (optional_member(j, "first_draw_ns") != nullptr) record.first_draw_ns = number(j, "first_draw_ns");
  if (const json* time = optional_member(j, "frame_time_ns")) record.frame_time = parse_frame_time(*time);
  if (const json* error = optional_member(j, "error")) record.error = parse_score(*error);
  if (record.status == Status::ok && !(record.frame_time && record.error))
    fail_input("status is ok, but 'frame_time_ns' or 'error' is missing");
  check_backend(record);
}

json summary_json(const Summary& summary) {
  return {{"median", summary.median},
          {"mad", summary.mad},
          {"ci_low", summary.ci_low},
          {"ci_high", summary.ci_high},
          {"n", summary.n}};
}

std::string match_key(const Record& record) {
  if (!record.scene_key.is_known()) return record.case_id;
  const std::string name = "@" + record.scene + "?";
  const std::size_t at = record.case_id.find(name);
  if (at == std::string::npos) return fmt::format("{}@{}", record.case_id, record.scene_key.hex);
  return fmt::format("{}@{}?{}", record.case_id.substr(0, at), record.scene_key.hex,
                     record.case_id.substr(at + name.size()));
}

void to_json(json& j, const Sample& sample) {
  if (!(sample.frame_time_ns > 0))  // it could not be read back, and ratios of it mean nothing
    fail_environment("case {}: a frame took {} ns: the timer is not to be believed", sample.case_id.text(),
                     sample.frame_time_ns);
  json line = {{"case", sample.case_id.text()},
               {"round", sample.round},
               {"frames", sample.frames},
               {"frame_time_ns", sample.frame_time_ns},
               {"at_ns", sample.at_ns}};
  if (sample.part != 0) line["part"] = sample.part;
  j = checked(std::move(line));
}

void from_json(const json& j, Sample& sample) {
  sample = {.case_id = text(j, "case"),
            .round = integer<int>(j, "round"),
            .frames = integer<int>(j, "frames"),
            .frame_time_ns = positive(j, "frame_time_ns"),
            .at_ns = number(j, "at_ns"),
            .part = optional_member(j, "part") != nullptr ? integer<int>(j, "part") : 0};
}

}  // namespace reliefbench
