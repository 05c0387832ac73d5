#include "tuner/results/join.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "kernels/base/clock.h"
#include "kernels/base/error.h"
#include "kernels/base/sha256.h"
#include "tuner/plan/scene_json.h"
#include "tuner/results/device_json.h"
#include "tuner/results/json_text.h"
#include "tuner/results/relative_time.h"
#include "tuner/results/run_files.h"
#include "tuner/results/run_parts.h"
#include "tuner/results/run_question.h"

namespace reliefbench {
namespace {

using nlohmann::json;

json list_in(const json& object, const char* key) { return object.value(key, json::array()); }

std::string folder_text(const Run& run) { return run.folder.string(); }

/// The processor that draws, where none but the host's does.
std::string drawing_cpu(const Run& run, std::string_view backend) {
  const bool is_software = device_of(run.info, backend).value("software", json(false)) == true;
  return is_software ? run.info.value(json::json_pointer("/host/cpu"), "") : "";
}

void check_begun(const Run& run) {
  if (is_of_tune(run)) fail_input("{}: is of tune; merge joins runs of sweep", folder_text(run));
  if (!run.info.contains("started_unix_ns"))
    fail_input("{}: has not begun; the command that made it goes on with it", folder_text(run));
}

void check_same_devices(const Run& first, const Run& run) {
  for (const json& own : list_in(run.info["identity"], "devices")) {
    const std::string backend = own.value("backend", "");
    const json other = device_of(first.info["identity"], backend);
    if (other.empty()) continue;
    for (const char* key : {"name", "driver"})
      if (own.value(key, "") != other.value(key, ""))
        fail_input("{}: its {} device has the {} '{}', that of {} '{}'", folder_text(run), backend, key,
                   own.value(key, ""), folder_text(first), other.value(key, ""));
    if (drawing_cpu(run, backend) != drawing_cpu(first, backend))
      fail_input("{}: its {} device draws on '{}', that of {} on '{}'", folder_text(run), backend,
                 drawing_cpu(run, backend), folder_text(first), drawing_cpu(first, backend));
  }
}

bool is_of_same_size(const Scene& a, const Scene& b) { return a.width_px == b.width_px && a.height_px == b.height_px; }

void check_scenes(const Run& first, const Run& run) {
  for (const MeasuredScene& scene : run.scenes) {
    const auto known =
        std::ranges::find(first.scenes, scene.spec.id, [](const MeasuredScene& one) { return one.spec.id; });
    if (known != first.scenes.end() && known->key != scene.key)
      fail_input("{}: scene '{}' is not that of {}: {}{}", folder_text(run), scene.spec.id, folder_text(first),
                 difference_text(*known, scene),
                 is_of_same_size(known->spec.scene, scene.spec.scene)
                     ? ""
                     : "; `sweep --frame-px` gives all shards one size, whatever draws them");
  }
}

void check_joinable(const Run& first, const Run& run) {
  check_scenes(first, run);
  check_same_devices(first, run);
  const auto differs = [&](const char* key) {
    return run.info["identity"].value(key, json()) != first.info["identity"].value(key, json());
  };
  if (differs("kernels_sha256"))
    fail_input("{}: was measured with other kernels (shaders, bakers, harness) than {}", folder_text(run),
               folder_text(first));
  if (differs("config_sha256")) fail_input("{}: is of another config than {}", folder_text(run), folder_text(first));
  if (differs("injected_slowdown"))
    fail_input("{}: has other injected slowdowns than {}", folder_text(run), folder_text(first));
}

/// What the same case must have on every machine, flat: "/error/e_xy/p99" -> value
json deterministic(const Record& record) {
  json all = record;
  for (const char* key : {"status", "reason", "frame_time_ns", "bake_time_ns", "device_bake_ns", "first_draw_ns"})
    all.erase(key);
  return all.flatten();
}

void check_equal(const Record& record, const Run& run, const Record& earlier, const Run& earlier_run) {
  const json now = deterministic(record);
  const json before = deterministic(earlier);
  if (now == before) return;
  json keys = before;
  keys.update(now);
  for (const auto& item : keys.items()) {
    const json value = now.value(item.key(), json());
    const json other = before.value(item.key(), json());
    if (value != other)
      fail_input("{}: case '{}': its '{}' is {}, in {} {}", folder_text(run), record.case_id, item.key().substr(1),
                 value.dump(), folder_text(earlier_run), other.dump());
  }
}

/// Where the record of a case stands.
struct Owner {
  std::size_t run;
  std::size_t record;
};

std::vector<Owner> owners_of(const std::vector<Run>& runs, std::size_t& held_twice) {
  std::vector<Owner> owners;
  std::unordered_map<std::string_view, std::size_t> places;
  for (std::size_t r = 0; r < runs.size(); ++r)
    for (std::size_t i = 0; i < runs[r].records.size(); ++i) {
      const Record& record = runs[r].records[i];
      const auto [found, is_new] = places.try_emplace(record.case_id, owners.size());
      if (is_new) {
        owners.push_back({.run = r, .record = i});
        continue;
      }
      ++held_twice;
      Owner& owner = owners[found->second];
      const Run& other_run = runs[owner.run];
      const Record& other = other_run.records[owner.record];
      if (record.status != Status::ok) continue;
      if (other.status == Status::ok)
        check_equal(record, runs[r], other, other_run);
      else
        owner = {.run = r, .record = i};
    }
  return owners;
}

/// By backend: what brings a run's times to the speed of the first run's device.
std::map<std::string, double> speed_factors(const Run& run, const json& first) {
  std::map<std::string, double> factors;
  for (const json& device : list_in(run.info, "devices")) {
    const std::string backend = device.value("backend", "");
    const double own_ns = control_reference_ns(run.info, backend);
    const double first_ns = control_reference_ns(first, backend);
    if (own_ns > 0 && first_ns > 0) factors.emplace(backend, first_ns / own_ns);
  }
  return factors;
}

FrameTime scaled_time(FrameTime time, double factor) {
  for (double* value : {&time.summary.median, &time.summary.mad, &time.summary.ci_low, &time.summary.ci_high})
    *value *= factor;
  return time;
}

/// "devices" of all runs, one of each backend: the first. where: the object that has them
json united_devices(const std::vector<Run>& runs, const json::json_pointer& where) {
  json all = {{"devices", json::array()}};
  for (const Run& run : runs)
    for (const json& device : list_in(run.info.at(where), "devices"))
      if (device_of(all, device.value("backend", "")).empty()) all["devices"].push_back(device);
  return all;
}

/// Adds the numbers of an object to those of another one.
void add_numbers(json& sum, const json& more) {
  for (const auto& item : more.items()) {
    if (!item.value().is_number()) continue;
    json& total = sum[item.key()];
    if (total.is_number_integer() && item.value().is_number_integer())
      total = total.get<std::int64_t>() + item.value().get<std::int64_t>();
    else
      total = total.is_null() ? item.value() : json(total.get<double>() + item.value().get<double>());
  }
}

/// Of a value that all runs share; nothing where they differ.
json shared_value(const std::vector<Run>& runs, const char* key) {
  const json value = runs.front().info["identity"].value(key, json());
  const auto has_it = [&](const Run& run) { return run.info["identity"].value(key, json()) == value; };
  return std::ranges::all_of(runs, has_it) ? value : json();
}

/// The parts as text, wherever they lay and in whatever order they were joined.
std::vector<std::string> part_texts(const std::vector<json>& parts) {
  std::vector<std::string> texts;
  texts.reserve(parts.size());
  for (json part : parts) {
    part.erase("folder");
    texts.push_back(json_text(part, -1));
  }
  std::ranges::sort(texts);
  return texts;
}

json merged_identity(const std::vector<Run>& runs, const std::vector<json>& parts) {
  json identity = runs.front().info["identity"];
  for (const char* key : {"filter", "case"}) {
    identity.erase(key);
    if (const json value = shared_value(runs, key); !value.is_null()) identity[key] = value;
  }
  identity.erase("shard");
  identity.update(united_devices(runs, json::json_pointer("/identity")));
  identity["merged"] = sha256(fmt::format("{}", fmt::join(part_texts(parts), "\n")));
  return identity;
}

json info_of(const std::vector<Run>& runs, const JoinedRuns& joined, const std::vector<json>& parts,
             double started_ns) {
  json info = runs.front().info;
  info["identity"] = merged_identity(runs, parts);
  info["parts"] = parts;
  info.update(united_devices(runs, json::json_pointer("")));
  set_states(info["devices"].get_ref<json::array_t&>(), joined.run.blocks);
  info["scenes"] = scenes_json(joined.run.scenes);
  info["started_unix_ns"] = started_ns;
  info["started"] = utc_text(started_ns);
  info["finished"] = nullptr;
  for (const json& part : parts)
    if (const json end = part.value("finished", json()); joined.missing.empty() && end.is_string())
      info["finished"] = info["finished"].is_null() ? end : std::max(info["finished"], end);
  for (const char* sum : {"wall_s", "counts"}) {
    info[sum] = json::object();
    for (const Run& run : runs) add_numbers(info[sum], run.info.value(sum, json::object()));
  }
  json& counts = info["counts"];
  counts["cases"] = joined.run.records.size();
  counts["statuses"] = json::object();
  for (const Record& record : joined.run.records) {
    json& count = counts["statuses"][std::string(status_id(record.status))];
    count = count.is_null() ? 1 : count.get<int>() + 1;
  }
  return info;
}

double start_of(const Run& run) { return run.info["started_unix_ns"].get<double>(); }

/// Moves the samples of a run's own cases and of its control cases.
void append_samples(Run& run, const std::unordered_set<std::string>& own_cases, double started_ns, int first_part,
                    std::vector<Sample>& all) {
  const std::string control = control_case_id("");
  for (Sample& sample : run.samples) {
    if (!own_cases.contains(sample.case_id) && !sample.case_id.text().starts_with(control)) continue;
    sample.at_ns += start_of(run) - started_ns;
    sample.part += first_part;
    all.push_back(std::move(sample));
  }
  run.samples.clear();
}

void append_blocks(const Run& run, double started_ns, int first_part, std::vector<BlockState>& all) {
  for (BlockState block : run.blocks) {
    block.from_ns += start_of(run) - started_ns;
    block.to_ns += start_of(run) - started_ns;
    block.part += first_part;
    all.push_back(std::move(block));
  }
}

void set_control_range(JoinedRuns& joined, const std::vector<json>& parts, const json& first) {
  for (const json& part : parts)
    for (const json& device : list_in(part, "devices")) {
      const double own_ns = device.value("control_reference_ns", 0.0);
      const double first_ns = control_reference_ns(first, device.value("backend", ""));
      if (own_ns <= 0 || first_ns <= 0) continue;
      joined.least_control = std::min(joined.least_control, own_ns / first_ns);
      joined.greatest_control = std::max(joined.greatest_control, own_ns / first_ns);
    }
}

}  // namespace

JoinedRuns join(std::vector<Run> runs) {
  for (const Run& run : runs) check_begun(run);
  for (std::size_t r = 1; r < runs.size(); ++r)
    for (std::size_t before = 0; before < r; ++before) check_joinable(runs[before], runs[r]);

  JoinedRuns joined;
  std::vector<Owner> owners = owners_of(runs, joined.held_twice);
  if (joined.held_twice == 0) {  // then no order was asked for, and all orders make one run
    std::ranges::stable_sort(runs, {}, start_of);
    owners = owners_of(runs, joined.held_twice);
  }
  if (owners.empty())
    throw Error(Exit::nothing_measured, fmt::format("{}: nothing was measured", folder_text(runs.front())));
  std::vector<std::unordered_set<std::string>> owned(runs.size());
  for (const Owner& owner : owners) owned[owner.run].insert(runs[owner.run].records[owner.record].case_id);

  std::vector<Run> adding;
  std::vector<std::size_t> places;  // there, of those that add something
  for (std::size_t r = 0; r < runs.size(); ++r) {
    places.push_back(adding.size());
    if (owned[r].empty())
      joined.left_out.push_back(folder_text(runs[r]));
    else
      adding.push_back(std::move(runs[r]));
  }
  const json first = united_devices(adding, json::json_pointer(""));
  std::vector<std::map<std::string, double>> factors;
  factors.reserve(adding.size());
  for (const Run& run : adding) factors.push_back(speed_factors(run, first));
  for (const Owner& owner : owners) {
    Record& record = joined.run.records.emplace_back(std::move(adding[places[owner.run]].records[owner.record]));
    const auto& own = factors[places[owner.run]];
    if (const auto factor = own.find(record.backend); record.frame_time && factor != own.end())
      record.frame_time = scaled_time(*record.frame_time, factor->second);
  }

  double started_ns = start_of(adding.front());
  for (const Run& run : adding) started_ns = std::min(started_ns, start_of(run));
  std::vector<json> parts;
  for (std::size_t r = 0; r < places.size(); ++r) {
    if (owned[r].empty()) continue;
    Run& run = adding[places[r]];
    append_samples(run, owned[r], started_ns, static_cast<int>(parts.size()), joined.run.samples);
    append_blocks(run, started_ns, static_cast<int>(parts.size()), joined.run.blocks);
    joined.run.scenes = joined_scenes(joined.run.scenes, run.scenes, folder_text(run));
    for (json& part : parts_of(run)) parts.push_back(std::move(part));
  }
  // The others have no samples here, but may make a division whole.
  for (std::size_t r = 0; r < runs.size(); ++r)
    if (owned[r].empty())
      for (json& part : parts_of(runs[r])) {
        if (std::ranges::any_of(parts, [&](const json& known) { return part_key(known) == part_key(part); })) continue;
        part[kAddsNothing] = true;
        parts.push_back(std::move(part));
      }
  set_control_range(joined, parts, first);
  joined.missing = missing_of(parts);
  joined.run.info = info_of(adding, joined, parts, started_ns);
  return joined;
}

}  // namespace reliefbench
