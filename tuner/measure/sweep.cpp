#include "tuner/measure/sweep.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <set>

#include "kernels/base/clock.h"
#include "kernels/base/error.h"
#include "kernels/base/sha256.h"
#include "tuner/measure/prepare.h"
#include "tuner/measure/progress.h"
#include "tuner/measure/run_info.h"
#include "tuner/measure/run_results.h"
#include "tuner/measure/timing.h"
#include "tuner/plan/plan.h"
#include "tuner/results/relative_time.h"
#include "tuner/results/run_files.h"
#include "tuner/results/store.h"

namespace reliefbench {
namespace {

// Where the control case ran at less than a quarter of its calibrated speed, the device is not itself.
constexpr double kThrottledRatio = 4;

const SceneSpec& scene_of(const Config& config, const Case& c) {
  return *std::find_if(config.scenes.begin(), config.scenes.end(),
                       [&](const SceneSpec& s) { return s.id == c.scene_id; });
}

nlohmann::json identity_of(const Config& config, const SweepOptions& options,
                           const std::vector<std::unique_ptr<Session>>& sessions) {
  nlohmann::json devices = nlohmann::json::array();
  for (const auto& session : sessions) devices.push_back(device_identity(session->device()));
  return {{"schema", kSchemaVersion},
          {"config_sha256", config_sha256(config)},
          {"kernels_sha256", kernels_sha256()},
          {"filter", options.filter},
          {"devices", devices}};
}

/// Fills the record's time from its samples, each corrected by the control samples next to it.
void set_frame_time(Record& record, const SamplesByCase& samples, const Session& session) {
  const std::vector<Sample>& own = samples.at(record.case_id);
  const std::vector<Sample>& control = samples.at(control_case_id(record.backend));
  const std::vector<double> raw_ns = raw_times(own);
  record.frame_time =
      FrameTime{.summary = summarise(corrected_times_ns(own, control, session.calibration().reference_ns)),
                .raw_median = median(raw_ns),
                .timer = std::string(timer_id(session.calibration().timer))};
  const double slowdown = record.frame_time->raw_median / record.frame_time->summary.median;
  if (slowdown > kThrottledRatio) {
    record.status = Status::throttled;
    record.reason = fmt::format("the control case ran {:.1f} times slower than when the run began", slowdown);
  }
}

/// One device's share of a sweep.
class DeviceSweep {
 public:
  DeviceSweep(const Config& config, const SweepOptions& options, Session& session, MapLibrary& library,
              const Cache& cache, WallSplit& split, RunStore& store, SamplesByCase& samples, double started_ns)
      : config_(config),
        session_(session),
        split_(split),
        store_(store),
        samples_(samples),
        started_ns_(started_ns),
        preparer_({.session = session,
                   .library = library,
                   .cache = cache,
                   .split = split,
                   .folder = options.output,
                   .timeout_s = config.measure.timeout_s,
                   .flicker_frames = config.measure.flicker_frames}) {}

  /// pending: this device's cases without a record. on_progress: with the number of cases done so far
  std::vector<Record> run(const std::vector<const Case*>& pending, const std::function<void(double)>& on_progress) {
    std::vector<Record> records;
    const auto block_size = static_cast<std::size_t>(config_.measure.block_cases);
    for (std::size_t from = 0; from < pending.size(); from += block_size) {
      const std::size_t count = std::min(block_size, pending.size() - from);
      const std::vector<const Case*> block(pending.begin() + static_cast<std::ptrdiff_t>(from),
                                           pending.begin() + static_cast<std::ptrdiff_t>(from + count));
      run_block(block, records, [&](double fraction) {
        on_progress(static_cast<double>(from) + fraction * static_cast<double>(count));
      });
    }
    return records;
  }
  [[nodiscard]] const Preparer& preparer() const { return preparer_; }

 private:
  void run_block(const std::vector<const Case*>& block, std::vector<Record>& records,
                 const std::function<void(double)>& on_progress) {
    std::vector<PreparedCase> prepared;
    prepared.reserve(block.size());
    std::vector<PreparedCase*> timed;
    for (const Case* c : block) {
      prepared.push_back(preparer_.prepare(*c, scene_of(config_, *c)));
      if (prepared.back().record.status == Status::ok) timed.push_back(&prepared.back());
      on_progress(kPrepareShare * static_cast<double>(prepared.size()) / static_cast<double>(block.size()));
    }
    std::string failure;
    try {
      time_block(timed, {.session = session_,
                         .measure = config_.measure,
                         .split = split_,
                         .seed = config_.seed ^ std::hash<std::string>{}(block.front()->id()),
                         .samples_so_far = samples_,
                         .clock_ns = [this] { return unix_ns() - started_ns_; },
                         .on_sample =
                             [this](const Sample& sample) {
                               store_.append(sample);
                               samples_[sample.case_id].push_back(sample);
                             },
                         .on_progress =
                             [&](double fraction) { on_progress(kPrepareShare + (1 - kPrepareShare) * fraction); }});
    } catch (const Error& error) {  // the device failed under a batch: its block ends here, finished cases count
      failure = error.what();
    }
    for (PreparedCase& one : prepared) {
      Record& record = one.record;
      if (record.status == Status::ok) {
        const auto count = static_cast<int>(samples_[record.case_id].size());
        if (count >= config_.measure.samples) {
          set_frame_time(record, samples_, session_);
        } else {
          record.status = Status::device_lost;
          record.reason = failure;
        }
      }
      store_.append(record);
      records.push_back(record);
    }
  }

  static constexpr double kPrepareShare = 0.7;  // of a block's time, for the progress bar

  const Config& config_;
  Session& session_;
  WallSplit& split_;
  RunStore& store_;
  SamplesByCase& samples_;  // of earlier starts, then of this one
  double started_ns_;
  Preparer preparer_;
};

}  // namespace

std::vector<std::string> choose_backends(const std::string& name) {
  if (name != "all") return {std::string(find_backend(name).id)};
  std::vector<std::string> ids;
  for (const BackendRow& row : backends())
    if (row.real && !row.devices().empty()) ids.emplace_back(row.id);
  if (ids.empty()) fail_environment("no OpenGL or Vulkan device was found (`reliefbench devices` lists them)");
  return ids;
}

SweepSummary run_sweep(const Config& config, const SweepOptions& options) {
  WallSplit split;
  const Plan plan = make_plan(config, options.backends, options.filter);
  const Cache cache = Cache::open();
  MapLibrary library(cache, split);
  for (const SceneSpec& scene : config.scenes) static_cast<void>(library.heights(scene));
  Progress progress(options.quiet);
  std::vector<std::unique_ptr<Session>> sessions;
  for (const std::string& id : options.backends)
    sessions.push_back(std::make_unique<Session>(find_backend(id), options.device, split));

  RunStore store(options.output, identity_of(config, options, sessions));
  std::filesystem::create_directories((options.output / image_path("", "frame")).parent_path());
  const Run& earlier = store.earlier();
  const nlohmann::json info = earlier.info.is_null() ? nlohmann::json::object() : earlier.info;
  const double started_ns = info.value("started_unix_ns", unix_ns());
  SamplesByCase samples = group_samples(earlier.samples);
  std::set<std::string> finished;
  SweepSummary summary{.folder = options.output, .cases = static_cast<int>(plan.cases.size())};
  for (const Record& record : earlier.records) finished.insert(record.case_id);
  summary.resumed = static_cast<int>(finished.size());
  if (!finished.empty())
    progress.note(fmt::format("resuming: {} of {} cases are done", finished.size(), plan.cases.size()));

  std::vector<nlohmann::json> devices;
  for (const auto& session : sessions) {
    const std::optional<Calibration> known = known_calibration(info, session->device());
    split.book(Part::audit, [&] { session->calibrate(config.measure.batch_ms, known ? &*known : nullptr); });
    devices.push_back(device_json(*session));
  }
  store.write_info(run_info(config, devices, summary, started_ns, false));

  std::vector<Record> records = earlier.records;
  for (const auto& session : sessions) {
    std::vector<const Case*> pending;
    for (const Case& c : plan.cases)
      if (c.backend == session->device().backend && !finished.contains(c.id())) pending.push_back(&c);
    const auto done_before = static_cast<double>(records.size());
    DeviceSweep sweep(config, options, *session, library, cache, split, store, samples, started_ns);
    const std::vector<Record> fresh = sweep.run(pending, [&](double done) {
      progress.update((done_before + done) / static_cast<double>(plan.cases.size()),
                      fmt::format("{} cases on {}", pending.size(), session->device().name));
    });
    records.insert(records.end(), fresh.begin(), fresh.end());
    summary.references += sweep.preparer().references_traced();
    summary.references_cached += sweep.preparer().references_from_cache();
    summary.shaders += session->shaders_compiled();
  }
  progress.finish();

  write_results(config, load_run(options.output));
  for (const Record& record : records) summary.statuses[std::string(status_id(record.status))] += 1;
  summary.bakes = library.baked();
  summary.bakes_cached = library.from_cache();
  summary.total_s = split.total_seconds();
  summary.other_s = summary.total_s;
  for (std::size_t i = 0; i < kPartIds.size(); ++i) {
    summary.part_s.at(i) = split.seconds(static_cast<Part>(i));
    summary.other_s -= summary.part_s.at(i);
  }
  store.write_info(run_info(config, devices, summary, started_ns, true));
  return summary;
}

}  // namespace reliefbench
