#include "tuner/measure/sweep.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <random>
#include <set>

#include "backends/worker/remote.h"
#include "kernels/base/clock.h"
#include "kernels/base/file_error.h"
#include "kernels/base/sha256.h"
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
#include "tuner/results/relative_time.h"
#include "tuner/results/run_files.h"
#include "tuner/results/run_folder.h"
#include "tuner/results/store.h"

namespace reliefbench {
namespace {

const SceneSpec& scene_of(const Config& config, const Case& c) {
  return *std::find_if(config.scenes.begin(), config.scenes.end(),
                       [&](const SceneSpec& s) { return s.id == c.scene_id; });
}

nlohmann::json identity_of(const Config& config, const SweepOptions& options,
                           const std::vector<std::unique_ptr<Session>>& sessions) {
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

/// Fills in the record's time from its samples. Where the device was held back, those of the block are forgotten, and
/// only a case that an earlier start had drawn all of has them.
void set_frame_time(Record& record, const SampleBook& book, const Calibration& calibration, int samples,
                    const std::string& held_back) {
  if (!held_back.empty() && book.samples(record.case_id).size() < static_cast<std::size_t>(samples)) {
    record.status = Status::throttled;
    record.reason = held_back;
    return;
  }
  record.frame_time = frame_time(book.samples(record.case_id), book.control_samples(), calibration.reference_ns,
                                 timer_id(calibration.timer));
}

/// Cases whose rounds of samples are drawn together.
using Block = std::vector<const Case*>;

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

/// One device's share of a sweep.
class DeviceSweep {
 public:
  DeviceSweep(const Config& config, const SweepOptions& options, Session& session, MapLibrary& library,
              const Cache& cache, WallSplit& split, RunStore& store, RecordBook& book, const RunClock& clock,
              Progress& progress)
      : config_(config),
        folder_(options.output),
        split_(split),
        session_(session),
        store_(store),
        book_(book),
        is_compiled_alone_(store.mark().death() || !store.earlier().failures.empty()),
        samples_(store, SampleBook::Control{.id = control_case_id(session.device().backend),
                                            .reference_ns = session.calibration().reference_ns}),
        timing_({.session = session,
                 .book = samples_,
                 .measure = config.measure,
                 .split = split,
                 .mark = &store.mark(),
                 .slowdowns = &options.slowdowns,
                 .clock = clock,
                 .cooling_pause_s = options.cooling_pause_s,
                 .progress = &progress}),
        preparer_({.session = session,
                   .library = library,
                   .cache = cache,
                   .split = split,
                   .timeout_s = config.measure.timeout_s,
                   .flicker_frames = config.measure.flicker_frames}) {}

  /// blocks: of this device's cases that are to be drawn. on_progress: with the number of cases done so far
  void run(const std::vector<Block>& blocks, const std::function<void(double)>& on_progress) {
    std::size_t done = 0;
    for (const Block& block : blocks) {
      run_block(block, [&](double fraction) {
        on_progress(static_cast<double>(done) + fraction * static_cast<double>(block.size()));
      });
      done += block.size();
    }
  }
  /// pictured: of all devices
  void draw_pictures(const std::set<const Record*>& pictured, const Plan& plan, Progress& progress) {
    write_pictures({.session = session_,
                    .preparer = preparer_,
                    .split = split_,
                    .mark = store_.mark(),
                    .folder = folder_,
                    .progress = progress},
                   pictured, plan.cases, config_.scenes);
  }
  [[nodiscard]] const Preparer& preparer() const { return preparer_; }

 private:
  void run_block(const Block& block, const std::function<void(double)>& on_progress) {
    if (session_.device().software) session_.drop_old_pipelines(kMostSoftwarePipelines);
    compile_ahead(block);
    std::vector<PreparedCase> prepared;
    prepared.reserve(block.size());
    for (const Case* c : block) {
      const auto hold = store_.mark().hold(c->id());
      prepared.push_back(preparer_.prepare(*c, scene_of(config_, *c)));
      if (session_.is_lost(prepared.back().record.status)) reopen(prepared);
      on_progress(kPrepareShare * static_cast<double>(prepared.size()) / static_cast<double>(block.size()));
    }
    const std::string held_back = draw_block(timing_, [&] {
      sample(prepared, [&](double fraction) { on_progress(kPrepareShare + (1 - kPrepareShare) * fraction); });
    });
    for (PreparedCase& one : prepared) {
      Record& record = one.record;
      if (record.status == Status::ok)
        set_frame_time(record, samples_, session_.calibration(), config_.measure.samples, held_back);
      book_.append(record);
    }
  }

  /// Compiles a block's shaders at once, until the device is lost over it or an earlier start ended in a case: then
  /// each in its own case, so that it is known which one it was. Software rasterisers compile at the first draw.
  void compile_ahead(const Block& block) {
    if (session_.device().software || is_compiled_alone_) return;
    std::vector<Session::Wanted> wanted;
    for (const Case* c : block) {
      const Scene& scene = scene_of(config_, *c).scene;
      for (const Target& target : {color_target(pixel_features(c->settings), needs_depth(scene)), Target::score})
        wanted.push_back({.settings = &c->settings, .target = target, .scene = &scene});
    }
    const auto hold = store_.mark().hold(block.front()->id());
    session_.compile_ahead(wanted);
    if (!session_.backend().is_gone()) return;
    is_compiled_alone_ = true;
    preparer_.release();
    session_.reopen();
  }

  /// Samples the cases of a block that are ok. One that fails in its frames gets its status, and the others go on.
  void sample(std::vector<PreparedCase>& block, const std::function<void(double)>& on_progress) {
    for (int lost_by_control = 0;;) {
      make_drawable(block);
      try {
        time_block(block, on_progress);
        return;
      } catch (const CaseFailed& failed) {
        const auto owner = std::ranges::find_if(
            block, [&](const PreparedCase& one) { return one.record.case_id == failed.record.case_id; });
        owner->record = failed.record;
        owner->release();
        if (session_.is_lost(failed.record.status)) reopen(block);
      } catch (const Error& error) {
        if (!session_.is_lost(error.fault()) || ++lost_by_control > kMostLostByControl) throw;  // it is no case's fault
        reopen(block);
      }
    }
  }

  /// Warms the cases up, then draws each once a round, in an order that is shuffled anew, until all have their samples.
  void time_block(const std::vector<PreparedCase>& block, const std::function<void(double)>& on_progress) {
    const auto wants_more = [&](const Record& record) {
      return static_cast<int>(samples_.samples(record.case_id).size()) < config_.measure.samples;
    };
    std::vector<TimedCase> cases;
    for (const PreparedCase& one : block)
      if (one.record.status == Status::ok && wants_more(one.record))
        cases.push_back(warm_up(timing_, one.record, one.draws));
    std::mt19937_64 random(config_.seed ^ std::hash<std::string>{}(block.front().record.case_id));
    for (int round = 1; !cases.empty(); ++round) {
      std::vector<TimedCase> order = cases;
      std::shuffle(order.begin(), order.end(), random);
      time(timing_, order);
      std::erase_if(cases, [&](const TimedCase& one) { return !wants_more(*one.record); });
      on_progress(static_cast<double>(round) / config_.measure.samples);
    }
  }

  /// Opens the lost device again; what the block had on it is gone.
  void reopen(std::vector<PreparedCase>& block) {
    for (PreparedCase& one : block) one.release();
    preparer_.release();
    try {
      session_.reopen();
    } catch (const Error&) {  // all ends here; the next start draws last what brought this one to its end
      for (const PreparedCase& one : block)
        if (one.record.status != Status::ok) book_.append(one.record);
      throw;
    }
  }

  /// Uploads and draws again what a block had on a lost device.
  void make_drawable(std::vector<PreparedCase>& block) {
    for (std::size_t i = 0; i < block.size();) {
      PreparedCase& one = block[i++];
      if (one.record.status != Status::ok || !one.draws.empty()) continue;
      PreparedCase again = preparer_.prepare_to_time(*one.spec, scene_of(config_, *one.spec));
      one.frame = std::move(again.frame);
      one.draws = std::move(again.draws);
      one.record.status = again.record.status;
      one.record.reason = again.record.reason;
      if (again.record.status == Status::ok || !session_.is_lost(again.record.status)) continue;
      reopen(block);
      i = 0;
    }
  }

  static constexpr double kPrepareShare = 0.7;  // of a block's time, for the progress bar

  const Config& config_;
  const std::filesystem::path& folder_;
  WallSplit& split_;
  Session& session_;
  RunStore& store_;
  RecordBook& book_;
  bool is_compiled_alone_;
  SampleBook samples_;
  Timing timing_;
  Preparer preparer_;
};

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
  std::vector<std::unique_ptr<Session>> sessions;
  std::vector<DeviceInfo> drawing;
  for (const std::string& id : options.backends) {
    sessions.push_back(std::make_unique<Session>(find_backend(id), options.device, split, true, options.open));
    sessions.back()->set_timeout(config.measure.timeout_s);
    if (has_compute(plan.cases)) sessions.back()->audit_compute();
    drawing.push_back(sessions.back()->device());
  }
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
  const nlohmann::json info = earlier.info.is_null() ? nlohmann::json::object() : earlier.info;
  const double started_ns = info.value("started_unix_ns", unix_ns());
  const RunClock clock(goes_on_at_ns(earlier, unix_ns() - started_ns));
  RecordBook book(store, options.retry_failed);
  for (const auto& session : sessions) book.enter_death(plan.cases, scenes, session->device());
  SweepSummary summary{.folder = options.output, .cases = static_cast<int>(plan.cases.size())};
  summary.resumed =
      static_cast<int>(std::ranges::count_if(plan.cases, [&](const Case& c) { return book.is_finished(c.id()); }));
  if (summary.resumed > 0)
    progress.note(fmt::format("resuming: {} of {} cases are done", summary.resumed, plan.cases.size()));

  std::vector<nlohmann::json> devices;
  for (const auto& session : sessions) {
    const std::optional<Calibration> known = known_calibration(info, session->device());
    split.book(Part::audit, [&] {
      session->calibrate(config.measure.batch_ms, known ? &*known : nullptr);
      session->measure_fills(config.scenes);
    });
    devices.push_back(device_json(*session));
  }
  summary.notes = std::move(notes);
  std::ranges::move(small_frame_notes({{"devices", devices}}), std::back_inserter(summary.notes));
  store.write_info(run_info(config, devices, scenes, summary, started_ns, false));

  double done_before = summary.resumed;
  for (const auto& session : sessions) {
    const std::vector<Block> blocks = blocks_of(plan, session->device().backend, book, config.measure.block_cases);
    std::size_t pending = 0;
    for (const Block& block : blocks) pending += block.size();
    DeviceSweep sweep(config, options, *session, library, cache, split, store, book, clock, progress);
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
    summary.shaders += session->shaders_compiled();
  }
  progress.finish();

  const Run run = load_run(options.output);
  check_complete(run, plan);
  write_results(config, run);
  remove_other_pictures(options.output, pictured_records(run.records, config, options.pictures));
  for (const Record& record : run.records) summary.statuses[std::string(status_id(record.status))] += 1;
  summary.open = static_cast<int>(std::ranges::count_if(
      run.records, [&](const Record& one) { return may_pass(one.status) && !book.is_given_up(one.case_id); }));
  set_costs(summary, library, split);
  set_states(devices, run.blocks);
  summary.held_back = static_cast<int>(
      std::ranges::count_if(run.blocks, [](const BlockState& block) { return !block.held_back.empty(); }));
  store.write_info(run_info(config, devices, scenes, summary, started_ns, true));
  return summary;
}

}  // namespace reliefbench
