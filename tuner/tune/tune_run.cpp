#include "tuner/tune/tune_run.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "kernels/base/error.h"
#include "tuner/measure/draw_block.h"
#include "tuner/measure/frame_size.h"
#include "tuner/measure/pictures.h"
#include "tuner/measure/run_info.h"
#include "tuner/plan/scene_json.h"
#include "tuner/results/frame_fill.h"
#include "tuner/results/relative_time.h"
#include "tuner/results/run_folder.h"
#include "tuner/tune/holdout.h"
#include "tuner/tune/tune_search.h"

namespace reliefbench {
namespace {

constexpr const char* kBisectedKey = "bisected";  // in run.json

nlohmann::json identity_of(const Config& config, const TuneOptions& options, const Session& session) {
  const TuneQuestion& question = options.question;
  nlohmann::json scenes = nlohmann::json::array();  // of a config some may be left out
  for (const SceneSpec& scene : config.scenes) scenes.push_back(scene.id);
  nlohmann::json identity = {{"schema", kSchemaVersion},
                             {"config_sha256", config_sha256(config)},
                             {"kernels_sha256", kernels_sha256()},
                             {"tune",
                              {{"max_error", budget_texts(question.max_error)},
                               {"scenes", scenes},
                               {"epsilon", question.epsilon},
                               {"confidence", question.confidence},
                               {"seed", question.seed},
                               {"combine", options.combine == Combine::worst ? "worst" : "weighted"},
                               {"weights", options.weights}}},
                             {"devices", nlohmann::json::array({device_identity(session.device())})}};
  // Then all errors count, none is taken for granted by bisection.
  if (!question.max_error.empty() && !has_one_answer(question)) identity["tune"]["whole_front"] = true;
  if (options.fleet) identity["tune"]["fleet"] = fleet_sha256(*options.fleet);
  return identity;
}

}  // namespace

TuneRun::TuneRun(Config config, const TuneOptions& options)
    : config_(std::move(config)),
      options_(options),
      progress_(options.quiet),
      plan_(make_plan(config_, std::vector{options.backend}, "")),
      cache_(Cache::open()),
      library_(cache_, split_),
      tuned_(library_.measured(config_.scenes)),
      holdout_(named_holdout(library_.measured(options.holdout), tuned_, {})) {
  for (const Case& c : plan_.cases)
    if (c.scene_id == config_.scenes.front().id) settings_.push_back(c.settings);
  session_ = std::make_unique<Session>(find_backend(options.backend), options.device, split_,
                                       SessionOptions{.audits = audits_for(has_compute(plan_.cases)),
                                                      .open = options.open,
                                                      .timeout_s = config_.measure.timeout_s});
  set_frames();
  store_ = std::make_unique<RunStore>(options.output, identity_of(config_, options, *session_));
  holdout_ = named_holdout(holdout_, tuned_, store_->earlier().scenes);
  scenes_ = joined_scenes(store_->earlier().scenes, tuned_, options.output.string());
  scenes_ = joined_scenes(scenes_, holdout_, options.output.string());
  make_images_folder(options.output);
  records_ = std::make_unique<RecordBook>(*store_, options.retry_failed);
  records_->enter_death(all_cases(), scenes_, session_->device());
  const nlohmann::json& info = store_->earlier().info;
  if (info.is_object() && info.contains(kBisectedKey)) is_bisected_ = info.at(kBisectedKey) == true;
  start_.emplace(store_->earlier());
  calibrate(*session_, config_, store_->earlier(), split_);
  if (const std::string note = held_back_note(*session_); !note.empty()) progress_.note(note);
  write_info(false);
  run_ = std::make_unique<DeviceRun>(*session_, RunParts{.config = config_,
                                                         .library = library_,
                                                         .cache = cache_,
                                                         .split = split_,
                                                         .store = *store_,
                                                         .start = *start_,
                                                         .progress = progress_,
                                                         .cooling_pause_s = options.cooling_pause_s});
}

void TuneRun::set_frames() {
  if (!has_default_frames(config_.scenes)) return;
  const DefaultFrame frame = default_frame({&session_->device(), 1}, config_, options_.output);
  frame_choice_ = frame.why;
  set_default_frames(config_, frame);
  std::vector<SceneSpec> holdout = options_.holdout;
  set_default_frames(holdout, frame);
  tuned_ = library_.measured(config_.scenes);
  holdout_ = named_holdout(library_.measured(holdout), tuned_, {});
}

nlohmann::json TuneRun::device_info() const { return {{"devices", nlohmann::json::array({device_json(*session_)})}}; }

CoarseFilter TuneRun::filter() const { return {device_info(), options_.backend}; }

std::vector<std::string> TuneRun::frame_notes() const { return small_frame_notes(device_info()); }

/// Those of the plan, and every setting on the held-out scenes.
std::vector<Case> TuneRun::all_cases() const {
  std::vector<Case> cases = plan_.cases;
  for (const MeasuredScene& scene : holdout_)
    for (const Settings& settings : settings_)
      cases.push_back({.settings = settings, .scene_id = scene.spec.id, .backend = options_.backend});
  return cases;
}

const Record* TuneRun::given_up(const std::string& case_id) const {
  const Record* const record = records_->find(case_id);
  return records_->is_given_up(case_id) && records_->is_finished(case_id) ? record : nullptr;
}

FrameScore TuneRun::score(const Case& c, const SceneSpec& scene, bool with_pictures) {
  const std::string id = c.id();
  if (const Record* const record = given_up(id)) fail_environment("{}", record->reason);
  const auto hold = store_->mark().hold(id);
  if (!with_pictures) {
    try {
      return run_->preparer.score(c, scene);
    } catch (const Error&) {
      keep_failure(c, scene);
      throw;
    }
  }
  const Record record = run_->preparer.prepare(c, scene).record;
  if (record.status == Status::ok) return *record.error;
  if (may_pass(record.status)) records_->append(record);
  fail_device(session_->is_lost(record.status) ? Fault::device_lost : Fault::other, "{}", record.reason);
}

void TuneRun::keep_failure(const Case& c, const SceneSpec& scene) {
  Record record = blank_record(c, scene_key(library_.loaded(scene).sha256, scene.scene), device());
  enter_failure(record, Status::unsupported);
  if (may_pass(record.status)) records_->append(record);
}

void TuneRun::draw(std::span<const Wanted> round) {
  for (int lost_by_control = 0;;) {
    try {
      draw_once(round);
      return;
    } catch (const CaseFailed&) {
      throw;
    } catch (const Error& error) {
      if (!session_->helps_reopening(error.fault()) || ++lost_by_control > kMostLostByControl) throw;
      reopen();
    }
  }
}

void TuneRun::draw_once(std::span<const Wanted> round) {
  std::vector<TimedCase> cases;
  cases.reserve(round.size());
  for (const Wanted& wanted : round) cases.push_back(ready(wanted));
  const std::string held_back = draw_block(
      run_->timing, [&] { time(run_->timing, cases); }, std::numeric_limits<double>::infinity());
  if (!held_back.empty())
    fail_environment("{} is held back: {}; what was timed before is kept, and the same command goes on with it",
                     device().name, held_back);
}

const TimedCase& TuneRun::ready(const Wanted& wanted) {
  const std::string id = wanted.spec.id();
  if (const auto found = ready_.find(id); found != ready_.end()) return found->second->timed;
  auto fresh = std::make_unique<Ready>(Ready{.spec = wanted.spec, .prepared = {}, .timed = {}});
  {
    const auto hold = store_->mark().hold(id);
    fresh->prepared = run_->preparer.prepare_to_time(fresh->spec, *wanted.scene);
  }
  if (fresh->prepared.record.status != Status::ok) throw CaseFailed(fresh->prepared.record);
  fresh->timed = warm_up(run_->timing, fresh->prepared.record, fresh->prepared.draws);
  return ready_.emplace(id, std::move(fresh)).first->second->timed;
}

const Record& TuneRun::whole_record(const Case& c, const SceneSpec& scene) {
  const std::string id = c.id();
  const std::vector<Sample>& samples = run_->samples.samples(id);
  const Record* const known = records_->find(id);
  if (known != nullptr && known->status == Status::ok &&
      known->frame_time->summary.n == static_cast<int>(samples.size()))
    return *known;
  const auto hold = store_->mark().hold(id);
  Record record = run_->preparer.prepare(c, scene).record;
  if (session_->is_lost(record.status)) reopen();
  if (record.status == Status::ok)
    record.frame_time = frame_time(samples, run_->samples.control_samples(), session_->calibration().reference_ns,
                                   timer_id(session_->calibration().timer));
  return keep(record);
}

/// Enters a record unless the same failure is there already; one that may pass counts every time.
const Record& TuneRun::keep(const Record& record) {
  const Record* const known = records_->find(record.case_id);
  const bool is_known = known != nullptr && known->status == record.status && known->reason == record.reason;
  const bool counts = may_pass(record.status) && given_up(record.case_id) == nullptr;
  if (record.status == Status::ok || !is_known || counts) records_->append(record);
  return *records_->find(record.case_id);
}

void TuneRun::take_failure(const CaseFailed& failed) {
  keep(failed.record);
  if (session_->is_lost(failed.record.status)) reopen();
}

void TuneRun::reopen() {
  ready_.clear();
  run_->preparer.release();
  session_->reopen();
}

void TuneRun::write_pictures(const Run& run) {
  ready_.clear();  // nothing more is timed, and a device that is lost over a picture takes its textures with it
  std::vector<SceneSpec> scenes = config_.scenes;
  for (const MeasuredScene& scene : holdout_) scenes.push_back(scene.spec);
  const std::set<const Record*> pictured = pictured_records(run.records, config_, Pictured::shown);
  reliefbench::write_pictures({.session = *session_,
                               .preparer = run_->preparer,
                               .split = split_,
                               .mark = store_->mark(),
                               .folder = options_.output,
                               .progress = progress_},
                              pictured, all_cases(), scenes);
  remove_other_pictures(options_.output, pictured);
}

void TuneRun::write_info(bool finished) {
  SweepSummary summary{.folder = options_.output, .cases = static_cast<int>(settings_.size())};
  set_costs(summary, library_, split_);
  summary.shaders = session_->pipelines().count_compiled();
  std::vector<nlohmann::json> devices = {device_json(*session_)};
  if (finished) set_states(devices, load_run(options_.output).blocks);
  nlohmann::json info = run_info(config_, devices, scenes_, summary, start_->unix_ns, finished);
  if (is_bisected_) info[kBisectedKey] = *is_bisected_;
  store_->write_info(info);
}

}  // namespace reliefbench
