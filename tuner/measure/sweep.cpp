#include "tuner/measure/sweep.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <set>

#include "backends/worker/remote.h"
#include "kernels/base/file_error.h"
#include "kernels/base/sha256.h"
#include "tuner/measure/device_sweep.h"
#include "tuner/measure/draw_block.h"
#include "tuner/measure/frame_size.h"
#include "tuner/measure/pictures.h"
#include "tuner/measure/prepare.h"
#include "tuner/measure/progress.h"
#include "tuner/measure/record_book.h"
#include "tuner/measure/run_info.h"
#include "tuner/measure/run_results.h"
#include "tuner/measure/timing.h"
#include "tuner/plan/plan.h"
#include "tuner/plan/scene_json.h"
#include "tuner/results/frame_fill.h"
#include "tuner/results/run_files.h"
#include "tuner/results/run_folder.h"
#include "tuner/results/store.h"

namespace reliefbench {
namespace {

using Sessions = std::vector<std::unique_ptr<Session>>;

nlohmann::json identity_of(const Config& config, const SweepOptions& options, const Sessions& sessions) {
  nlohmann::json devices = nlohmann::json::array();
  for (const auto& session : sessions) devices.push_back(device_identity(session->device()));
  nlohmann::json identity = {{"schema", kSchemaVersion},
                             {"config_sha256", config_sha256(config)},
                             {"kernels_sha256", kernels_sha256()},
                             {"filter", options.filter},
                             {"devices", devices}};
  if (!options.key.empty()) identity["case"] = options.key;
  if (options.shard) identity["shard"] = options.shard->text();
  if (!options.slowdowns.empty()) identity["injected_slowdown"] = options.slowdowns;
  return identity;
}

/// A backend's cases that are to be drawn, in blocks; those that an earlier start may have died of come last, each by
/// itself, so that all others are safe by then.
std::vector<Block> blocks_of(const Plan& plan, std::string_view backend, const RecordBook& book, int block_cases) {
  std::vector<Block> blocks;
  std::vector<Block> suspects;
  for (const Case& c : plan.cases) {
    if (c.backend != backend || book.is_finished(c.id())) continue;
    if (book.is_suspect(c.id())) {
      suspects.push_back({&c});
      continue;
    }
    if (blocks.empty() || blocks.back().size() == static_cast<std::size_t>(block_cases)) blocks.emplace_back();
    blocks.back().push_back(&c);
  }
  blocks.insert(blocks.end(), suspects.begin(), suspects.end());
  return blocks;
}

/// Those that crashed once: it may have been no fault of theirs.
std::vector<Block> crashed_once(const std::vector<Block>& blocks, const RecordBook& book) {
  std::vector<Block> again;
  for (const Block& block : blocks)
    for (const Case* c : block)
      if (book.find(c->id())->status == Status::crashed && !book.is_given_up(c->id())) again.push_back({c});
  return again;
}

/// What was measured must be in the file: another process may have meddled with it.
void check_complete(const Run& run, const Plan& plan) {
  std::set<std::string> ids;
  for (const Record& record : run.records) ids.insert(record.case_id);
  for (const Case& c : plan.cases)
    if (!ids.contains(c.id()))
      fail_environment("{}: case '{}' was measured, but its record is gone; start again to measure it",
                       (run.folder / kResultsFile).string(), c.id());
}

/// Bakes take compute shaders.
Audits audits_of(const Plan& plan, DeviceBakes device_bakes) {
  const bool has_bakes = std::ranges::any_of(plan.cases, [](const Case& c) { return has_device_bake(c.settings); });
  if (!has_bakes || device_bakes == DeviceBakes::never) return audits_for(has_compute(plan.cases));
  if (has_compute(plan.cases) || device_bakes == DeviceBakes::always) return Audits::of_dispatches;
  return Audits::of_hardware_dispatches;
}

/// One of each backend.
Sessions open_sessions(const Config& config, const SweepOptions& options, const Plan& plan, WallSplit& split) {
  const SessionOptions asked{
      .audits = audits_of(plan, options.device_bakes), .open = options.open, .timeout_s = config.measure.timeout_s};
  Sessions sessions;
  for (const std::string& id : options.backends)
    sessions.push_back(std::make_unique<Session>(find_backend(id), options.device, split, asked));
  return sessions;
}

/// What has become of the cases of a run that is complete.
void count_cases(SweepSummary& summary, const Run& run, const RecordBook& book) {
  for (const Record& record : run.records) summary.statuses[std::string(status_id(record.status))] += 1;
  summary.open = static_cast<int>(std::ranges::count_if(
      run.records, [&](const Record& one) { return may_pass(one.status) && !book.is_given_up(one.case_id); }));
  summary.held_back = static_cast<int>(
      std::ranges::count_if(run.blocks, [](const BlockState& block) { return !block.held_back.empty(); }));
}

}  // namespace

std::vector<std::string> choose_backends(const std::string& name) {
  if (name != "all") return {std::string(find_backend(name).id)};
  std::vector<std::string> ids;
  for (const BackendRow& row : backends())
    if (row.real && !isolated_devices(row).empty()) ids.emplace_back(row.id);
  if (ids.empty()) fail_environment("no OpenGL or Vulkan device was found (`reliefbench devices` lists them)");
  return ids;
}

std::string two_devices_note(std::span<const DeviceInfo> drawing) {
  const auto tells = [](const DeviceInfo& device) { return !device.pci.empty(); };
  const auto one = std::ranges::find_if(drawing, tells);
  const auto other =
      std::ranges::find_if(drawing, [&](const DeviceInfo& device) { return tells(device) && device.pci != one->pci; });
  if (one == drawing.end() || other == drawing.end()) return "";
  return fmt::format("device {} is {} ({}) on {} and {} ({}) on {}: their times are of different hardware", one->index,
                     one->name, one->pci, one->backend, other->name, other->pci, other->backend);
}

SweepSummary run_sweep(Config config, const SweepOptions& options) {
  WallSplit split;
  Plan plan = make_plan(config, options.backends, options.filter, options.key);
  if (options.shard) plan = shard_of(plan, config, *options.shard);
  const Cache cache = Cache::open();
  MapLibrary library(cache, split);
  std::vector<MeasuredScene> measured = library.measured(config.scenes);
  Progress progress(options.quiet);
  for (const std::string& reading : library.readings()) progress.note("read " + reading);
  const Sessions sessions = open_sessions(config, options, plan, split);
  std::vector<DeviceInfo> drawing;
  for (const auto& session : sessions) drawing.push_back(session->device());
  std::vector<std::string> notes;
  if (const std::string note = two_devices_note(drawing); !note.empty()) progress.note(notes.emplace_back(note));
  if (has_default_frames(config.scenes)) {
    const DefaultFrame frame = default_frame(drawing, config, options.output);
    set_default_frames(config, frame);
    measured = library.measured(config.scenes);
    progress.note(notes.emplace_back(frame.why));
  }

  RunStore store(options.output, identity_of(config, options, sessions));
  const Run& earlier = store.earlier();
  const std::vector<MeasuredScene> scenes = joined_scenes(earlier.scenes, measured, options.output.string());
  make_images_folder(options.output);
  const RunStart start(earlier);
  RecordBook book(store, options.retry_failed);
  for (const auto& session : sessions) book.enter_death(plan.cases, scenes, session->device());
  SweepSummary summary{.folder = options.output, .cases = static_cast<int>(plan.cases.size())};
  summary.resumed =
      static_cast<int>(std::ranges::count_if(plan.cases, [&](const Case& c) { return book.is_finished(c.id()); }));
  if (summary.resumed > 0)
    progress.note(fmt::format("resuming: {} of {} cases are done", summary.resumed, plan.cases.size()));

  std::vector<nlohmann::json> devices;
  for (const auto& session : sessions) {
    calibrate(*session, config, earlier, split);
    devices.push_back(device_json(*session));
    if (const std::string note = held_back_note(*session); !note.empty()) progress.note(notes.emplace_back(note));
  }
  summary.notes = std::move(notes);
  std::ranges::move(small_frame_notes({{"devices", devices}}), std::back_inserter(summary.notes));
  store.write_info(run_info(config, devices, scenes, summary, start.unix_ns, false));

  const RunParts parts{.config = config,
                       .library = library,
                       .cache = cache,
                       .split = split,
                       .store = store,
                       .start = start,
                       .progress = progress,
                       .cooling_pause_s = options.cooling_pause_s,
                       .slowdowns = &options.slowdowns};
  double done_before = summary.resumed;
  for (const auto& session : sessions) {
    const std::vector<Block> blocks = blocks_of(plan, session->device().backend, book, config.measure.block_cases);
    std::size_t pending = 0;
    for (const Block& block : blocks) pending += block.size();
    DeviceSweep sweep(*session, parts, book, options.output, options.device_bakes);
    sweep.run(blocks, [&](double done) {
      progress.update((done_before + done) / static_cast<double>(plan.cases.size()),
                      fmt::format("{} cases on {}", pending, session->device().name));
    });
    sweep.run(crashed_once(blocks, book), [](double) {});
    done_before += static_cast<double>(pending);
    progress.finish();
    Progress picturing(options.quiet);
    const Run so_far = load_run(options.output);
    sweep.draw_pictures(pictured_records(so_far.records, config, options.pictures), plan, picturing);
    summary.references += sweep.preparer().references_traced();
    summary.references_cached += sweep.preparer().references_from_cache();
    summary.shaders += session->pipelines().count_compiled();
    summary.shaders_cached += session->pipelines().count_cached();
  }
  progress.finish();

  const Run run = load_run(options.output);
  check_complete(run, plan);
  write_results(config, run);
  remove_other_pictures(options.output, pictured_records(run.records, config, options.pictures));
  count_cases(summary, run, book);
  set_costs(summary, library, split);
  set_states(devices, run.blocks);
  store.write_info(run_info(config, devices, scenes, summary, start.unix_ns, true));
  return summary;
}

}  // namespace reliefbench
