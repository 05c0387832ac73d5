#include <algorithm>
#include <chrono>
#include <exception>
#include <limits>
#include <memory>
#include <numeric>
#include <set>

#include "kernels/base/atomic_file.h"
#include "kernels/base/clock.h"
#include "kernels/base/error.h"
#include "kernels/base/sha256.h"
#include "tuner/decide/pareto.h"
#include "tuner/decide/recommend.h"
#include "tuner/measure/device_times.h"
#include "tuner/measure/map_library.h"
#include "tuner/measure/prepare.h"
#include "tuner/measure/progress.h"
#include "tuner/measure/record_book.h"
#include "tuner/measure/run_info.h"
#include "tuner/measure/run_results.h"
#include "tuner/plan/plan.h"
#include "tuner/plan/scene_json.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/relative_time.h"
#include "tuner/results/run_files.h"
#include "tuner/results/run_folder.h"
#include "tuner/tune/holdout.h"
#include "tuner/tune/tune_search.h"

namespace reliefbench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kMostOfErrorPass = 0.6;          // of the time limit: then it is cut off
constexpr double kMuchOfErrorPass = 1 / 3.0;      // of the time limit: rather bisect, where that is possible
constexpr const char* kBisectedKey = "bisected";  // in run.json

bool compares_pictures(const std::vector<Budget>& budgets, std::string_view error_metric) {
  return find_metric(error_metric).compares_pictures ||
         std::ranges::any_of(budgets, [](const Budget& b) { return find_metric(b.metric).compares_pictures; });
}

nlohmann::json identity_of(const Config& config, const TuneOptions& options, const Session& session) {
  const TuneQuestion& question = options.question;
  nlohmann::json scenes = nlohmann::json::array();  // of a config some may be left out
  for (const SceneSpec& scene : config.scenes) scenes.push_back(scene.id);
  return {{"schema", kSchemaVersion},
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
}

class DeviceTuner {
 public:
  DeviceTuner(const Config& config, const TuneOptions& options)
      : config_(config),
        options_(options),
        plan_(make_plan(config, std::vector{options.backend}, "")),
        cache_(Cache::open()),
        library_(cache_, split_),
        tuned_(library_.measured(config.scenes)),
        holdout_(named_holdout(library_.measured(options.holdout), tuned_, {})) {
    for (const Case& c : plan_.cases)
      if (c.scene_id == config.scenes.front().id) settings_.push_back(c.settings);
    session_ = std::make_unique<Session>(find_backend(options.backend), options.device, split_);
    session_->set_timeout(config.measure.timeout_s);
    store_ = std::make_unique<RunStore>(options.output, identity_of(config, options, *session_));
    holdout_ = named_holdout(holdout_, tuned_, store_->earlier().scenes);
    scenes_ = joined_scenes(store_->earlier().scenes, tuned_, options.output.string());
    scenes_ = joined_scenes(scenes_, holdout_, options.output.string());
    make_images_folder(options.output);
    records_ = std::make_unique<RecordBook>(*store_, options.retry_failed);
    records_->enter_death(all_cases(), scenes_, session_->device());
    const nlohmann::json& info = store_->earlier().info;
    started_ns_ = info.is_object() ? info.value("started_unix_ns", unix_ns()) : unix_ns();
    const std::optional<Calibration> known =
        info.is_object() ? known_calibration(info, session_->device()) : std::nullopt;
    split_.book(Part::audit, [&] { session_->calibrate(config.measure.batch_ms, known ? &*known : nullptr); });
    if (info.is_object() && info.contains(kBisectedKey)) is_bisected_ = info.at(kBisectedKey) == true;
    write_info(false);
    preparer_ = std::make_unique<Preparer>(Preparer::Context{.session = *session_,
                                                             .library = library_,
                                                             .cache = cache_,
                                                             .split = split_,
                                                             .folder = options.output,
                                                             .timeout_s = config.measure.timeout_s,
                                                             .flicker_frames = config.measure.flicker_frames});
    book_ = std::make_unique<SampleBook>(*store_,
                                         SampleBook::Control{.id = control_case_id(options.backend),
                                                             .reference_ns = session_->calibration().reference_ns});
    times_ = std::make_unique<DeviceTimes>(DeviceTimes::Context{.session = *session_,
                                                                .preparer = *preparer_,
                                                                .book = *book_,
                                                                .split = split_,
                                                                .mark = store_->mark(),
                                                                .measure = config.measure,
                                                                .started_ns = started_ns_});
  }

  TuneResult run() {
    result_.question = options_.question;
    result_.error_metric = config_.front_error;
    result_.constraints = config_.front_constraints;
    result_.backend = options_.backend;
    result_.device = session_->device().name;
    for (const MeasuredScene& scene : tuned_) {
      result_.scenes.push_back(scene.spec.id);
      result_.subjects.push_back(scene_description(scene.spec));
      result_.scene_keys.push_back(scene.key);
    }
    score_settings();
    const bool has_scenes = config_.scenes.size() > 1;
    race(has_scenes ? 0.5 : 1.0);
    if (has_scenes && result_.pick) answer_scenes();
    if (result_.pick) try_holdout();
    if (!result_.search.is_feasible) name_nearest();
    finish();
    return std::move(result_);
  }

 private:
  [[nodiscard]] double elapsed_s() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  [[nodiscard]] double limit_s() const {
    return options_.time_limit_s.value_or(std::numeric_limits<double>::infinity());
  }
  [[nodiscard]] bool is_over(double until_s) {
    const bool over = options_.is_interrupted() || elapsed_s() > until_s;
    result_.is_stopped |= over;
    return over;
  }
  [[nodiscard]] Case case_of(std::size_t scene, std::size_t setting) const {
    return {.settings = settings_[setting], .scene_id = config_.scenes[scene].id, .backend = options_.backend};
  }
  /// Those of the plan, and every setting on the held-out scenes.
  [[nodiscard]] std::vector<Case> all_cases() const {
    std::vector<Case> cases = plan_.cases;
    for (const MeasuredScene& scene : holdout_)
      for (const Settings& settings : settings_)
        cases.push_back({.settings = settings, .scene_id = scene.spec.id, .backend = options_.backend});
    return cases;
  }
  /// The record of a case that is not to be drawn again since it killed the process twice; null for any other.
  [[nodiscard]] const Record* given_up(const std::string& case_id) const {
    const Record* const record = records_->find(case_id);
    const bool is_crash = record != nullptr && record->status == Status::crashed;
    return is_crash && records_->is_finished(case_id) ? record : nullptr;
  }
  [[nodiscard]] const std::vector<Budget>& asked() const {
    return options_.question.max_error.empty() ? config_.front_constraints : options_.question.max_error;
  }
  [[nodiscard]] bool meets_asked(const FrameScore& score) const {
    return std::ranges::all_of(asked(), [&](const Budget& budget) { return meets(score, budget); });
  }

  void score_settings() {
    Progress progress(options_.quiet);
    for (const std::string& reading : library_.readings()) progress.note("read " + reading);
    const bool pictures = compares_pictures(asked(), config_.front_error);
    const auto judge_once = [&](std::size_t setting, std::size_t scene) {
      const Case c = case_of(scene, setting);
      const std::string id = c.id();
      if (const Record* const record = given_up(id)) fail_environment("{}", record->reason);
      const auto hold = store_->mark().hold(id);
      if (!pictures) return preparer_->judge(c, config_.scenes[scene]);
      const PreparedCase prepared = preparer_->prepare(c, config_.scenes[scene]);
      const bool is_lost = session_->is_lost(prepared.record.status);
      if (prepared.record.status != Status::ok)
        fail_device(is_lost ? Fault::device_lost : Fault::other, "{}", prepared.record.reason);
      return *prepared.record.error;
    };
    // A device that is lost is opened again; where that fails, all ends.
    std::exception_ptr end;
    const auto judge = [&](std::size_t setting, std::size_t scene) {
      try {
        return judge_once(setting, scene);
      } catch (const Error& error) {
        if (!needs_reopening(error.fault()) || end) throw;
      }
      try {
        reopen();
      } catch (const Error&) {
        end = std::current_exception();
      }
      fail_device(Fault::device_lost, "the device was lost");
    };
    const auto should_stop = [&](std::size_t done) {
      if (end) return true;
      progress.update(static_cast<double>(done) / static_cast<double>(settings_.size()),
                      fmt::format("errors of {} settings", settings_.size()));
      return is_over(kMostOfErrorPass * limit_s());
    };
    TuneCounts& counts = result_.counts;
    ErrorPass pass(settings_, config_.scenes.size(), {.judge = judge, .should_stop = should_stop});
    const double whole_s = pass.score_coarse();
    if (is_bisected_) {
      counts.is_bisected = *is_bisected_;  // or the settings to search would be others than they were
    } else if (!options_.question.max_error.empty() && options_.time_limit_s) {
      counts.is_bisected = whole_s > kMuchOfErrorPass * limit_s();
      if (counts.is_bisected)
        progress.note(fmt::format("all errors would take {:.0f} s of {:.0f} s: bisecting along the step counts",
                                  whole_s, limit_s()));
    }
    if (!options_.is_interrupted()) is_bisected_ = counts.is_bisected;
    write_info(false);
    if (counts.is_bisected)
      pass.bisect([&](const FrameScore& score) { return meets_asked(score); });
    else
      pass.score_rest();
    scores_ = pass.take();
    progress.finish();
    if (end) std::rethrow_exception(end);
    counts.settings = static_cast<int>(settings_.size());
    counts.conflicts = static_cast<int>(plan_.conflicts.size());
    for (const SettingScore& score : scores_) {
      counts.scored += score.scored == Scored::yes ? 1 : 0;
      counts.assumed += score.scored == Scored::assumed ? 1 : 0;
      counts.hopeless += score.scored == Scored::hopeless ? 1 : 0;
      counts.failed += score.scored == Scored::failed ? 1 : 0;
      counts.unscored += score.scored == Scored::no ? 1 : 0;
    }
  }

  [[nodiscard]] double weight_of(std::size_t scene, const std::vector<std::size_t>& scenes) const {
    return scenes.size() == 1 || options_.weights.empty() ? 1 : options_.weights[scene];
  }

  /// The scored settings as the search sees them. scenes: those whose errors count
  [[nodiscard]] SearchSpace space_of(const std::vector<std::size_t>& scenes) const {
    SearchSpace space = empty_setting_space();
    const MetricRow& metric = find_metric(config_.front_error);
    const std::vector<const MetricRow*> work = work_metrics();
    for (const std::size_t setting : candidates_) {
      Candidate candidate = candidate_of(settings_[setting], setting_id(settings_[setting]));
      for (const std::size_t scene : scenes) {
        const FrameScore& score = scores_[setting].scores[scene];
        candidate.error = std::max(candidate.error, metric.value(score).value_or(0));
        candidate.is_feasible &= meets_asked(score);
        for (std::size_t i = 0; i < work.size(); ++i)
          candidate.work[i] = combined(options_.combine, candidate.work[i], weight_of(scene, scenes),
                                       work[i]->value(score).value_or(0));
      }
      space.candidates.push_back(std::move(candidate));
    }
    return space;
  }

  [[nodiscard]] BookSource source_of(const std::vector<std::size_t>& scenes) {
    std::vector<BookSource::Scene> list;
    for (const std::size_t scene : scenes) {
      BookSource::Scene& entry = list.emplace_back();
      entry.weight = weight_of(scene, scenes);
      for (const std::size_t setting : candidates_) entry.case_ids.push_back(case_of(scene, setting).id());
    }
    return {*book_, std::move(list), options_.combine, [this, scenes](std::span<const BookSource::Wanted> round) {
              std::vector<DeviceTimes::Wanted> wanted;
              for (const auto& [scene, candidate] : round)
                wanted.push_back(
                    {.spec = case_of(scenes[scene], candidates_[candidate]), .scene = &config_.scenes[scenes[scene]]});
              times_->draw(wanted);
            }};
  }

  /// Of the map as it is uploaded for a scene, whether or not this start has done so yet.
  [[nodiscard]] MemoryOf memory_of(std::size_t scene) {
    return [this, scene](std::size_t candidate) -> std::int64_t {
      const Case c = case_of(scene, candidates_[candidate]);
      if (!c.settings.technique().reads_map()) return 0;
      const Scene& view = config_.scenes[scene].scene;
      const BakedMap& map = library_.map(c, config_.scenes[scene]);
      return static_cast<std::int64_t>(map_textures(c.settings, map, view.wrap, view.relief_depth).bytes());
    };
  }

  [[nodiscard]] std::vector<std::size_t> all_scenes() const {
    std::vector<std::size_t> scenes(config_.scenes.size());
    std::iota(scenes.begin(), scenes.end(), std::size_t{0});
    return scenes;
  }

  [[nodiscard]] std::optional<double> asked_front_error() const {
    for (const Budget& budget : config_.budgets)
      if (budget.metric == config_.front_error) return budget.limit;
    return std::nullopt;
  }

  void take_failure(const CaseFailed& failed) {
    keep(failed.record);
    if (session_->is_lost(failed.record.status)) reopen();
  }

  /// Opens the device again after it was lost.
  void reopen() {
    times_->release();
    preparer_->release();
    session_->reopen();
  }

  /// share: of the time that is left
  void race(double share) {
    const double until_s = elapsed_s() + share * (limit_s() - elapsed_s());
    for (;;) {
      candidates_.clear();
      for (std::size_t i = 0; i < settings_.size(); ++i)
        if (scores_[i].scored == Scored::yes) candidates_.push_back(i);
      if (candidates_.empty()) return;
      result_.space = space_of(all_scenes());
      BookSource source = source_of(all_scenes());
      Progress progress(options_.quiet);
      try {
        search_into(
            result_, source, [&] { return is_over(until_s); },
            [&](const SearchProgress& now) { show(progress, now, options_.question, elapsed_s() / until_s); },
            asked_front_error(), memory_of(0));
        progress.finish();
        return;
      } catch (const CaseFailed& failed) {  // the book is kept, so the search comes back to here at once
        take_failure(failed);
        const std::size_t setting = setting_of(setting_id(parse_setting(failed.record.case_id)));
        scores_[setting] = {.scored = Scored::failed, .failure = failed.record.reason};
        --result_.counts.scored;
        ++result_.counts.failed;
      }
    }
  }

  void answer_scenes() {
    for (std::size_t scene = 0; scene < config_.scenes.size(); ++scene) {
      const auto left = static_cast<double>(config_.scenes.size() - scene);
      const double until_s = elapsed_s() + (limit_s() - elapsed_s()) / left;
      TuneResult alone{.question = options_.question};
      alone.space = space_of({scene});
      BookSource source = source_of({scene});
      SceneAnswer answer{.scene = config_.scenes[scene].id};
      try {
        search_into(
            alone, source, [&] { return is_over(until_s); }, [](const SearchProgress&) {}, asked_front_error(),
            memory_of(scene));
        answer.own = alone.pick;
      } catch (const CaseFailed& failed) {  // drawn in the other scenes: this one's answer is left out
        take_failure(failed);
      }
      if (answer.own) set_gain(answer, scene);
      result_.scene_answers.push_back(std::move(answer));
    }
  }

  /// Holds a scene's own pick to the common one, on the samples that the scene has of both.
  void set_gain(SceneAnswer& answer, std::size_t scene) {
    const auto times_of = [&](const std::string& setting) {
      return book_->times(case_of(scene, setting_of(setting)).id());
    };
    const std::vector<double> common_times = times_of(result_.pick->setting);
    const std::vector<double> own_times = times_of(answer.own->setting);
    if (common_times.empty() || own_times.empty()) return;
    const Summary common = summarise(common_times);
    const Summary own = summarise(own_times);
    answer.common_ns = common.median;
    if (answer.own->setting == result_.pick->setting || own.median >= common.median) {
      answer.own = *result_.pick;
      answer.own_ns = common.median;
      return;
    }
    answer.own_ns = own.median;
    answer.gain = 1 - own.median / common.median;
    answer.gain_low = 1 - own.ci_high / common.ci_low;
    answer.gain_high = 1 - own.ci_low / common.ci_high;
  }

  [[nodiscard]] std::size_t setting_of(const std::string& id) const {
    return static_cast<std::size_t>(std::ranges::find(settings_, id, [](const Settings& s) { return setting_id(s); }) -
                                    settings_.begin());
  }

  void try_holdout() {
    const std::vector<Budget>& budgets = options_.question.max_error.empty() ? config_.budgets : asked();
    for (const auto& [scene, heights_hash, key] : holdout_) {
      const Case c{.settings = parse_setting(result_.pick->setting), .scene_id = scene.id, .backend = options_.backend};
      const std::string id = c.id();
      HoldoutAnswer answer{.scene = scene.id, .scene_key = key};
      try {
        if (const Record* const record = given_up(id)) throw CaseFailed{*record};
        const DeviceTimes::Wanted wanted{.spec = c, .scene = &scene};
        while (static_cast<int>(book_->times(id).size()) < config_.measure.samples) times_->draw({&wanted, 1});
        const Record& record = whole_record(c, scene);
        answer.failure = record.reason;
        if (record.error) {
          answer.error = find_metric(config_.front_error).value(*record.error).value_or(0);
          answer.miss = miss_of(budgets, *record.error).text;
          answer.time_ns = median(book_->times(id));
        }
      } catch (const CaseFailed& failed) {
        take_failure(failed);
        answer.failure = failed.record.reason;
      }
      result_.holdout.push_back(std::move(answer));
    }
  }

  void name_nearest() {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < settings_.size(); ++i) {
      if (scores_[i].scored != Scored::yes) continue;
      Miss worst;
      for (const FrameScore& score : scores_[i].scores) {
        Miss here = miss_of(asked(), score);
        if (here.worst >= worst.worst) worst = std::move(here);
      }
      if (worst.worst >= least) continue;
      least = worst.worst;
      result_.nearest = setting_id(settings_[i]);
      result_.miss = worst.text;
    }
  }

  /// The record of a case that was timed, with its error and pictures: as an earlier start left it if nothing was drawn
  /// since, or a search that is asked for again would enter it again.
  const Record& whole_record(const Case& c, const SceneSpec& scene) {
    const std::string id = c.id();
    const std::vector<double>& times = book_->times(id);
    const Record* const known = records_->find(id);
    if (known != nullptr && known->status == Status::ok &&
        known->frame_time->summary.n == static_cast<int>(times.size()))
      return *known;
    const auto hold = store_->mark().hold(id);
    Record record = preparer_->prepare(c, scene).record;
    if (session_->is_lost(record.status)) reopen();
    if (record.status == Status::ok)
      record.frame_time = FrameTime{.summary = summarise(times),
                                    .raw_median = median(raw_times(book_->samples(id))),
                                    .timer = std::string(timer_id(session_->calibration().timer))};
    return keep(record);
  }

  /// Enters a record unless the same failure is there already.
  const Record& keep(const Record& record) {
    const Record* const known = records_->find(record.case_id);
    if (known == nullptr || record.status == Status::ok || known->status != record.status ||
        known->reason != record.reason)
      records_->append(record);
    return *records_->find(record.case_id);
  }

  /// Settings that an answer names: these get a whole record, with pictures.
  [[nodiscard]] std::set<std::string> answering_settings() const {
    std::set<std::string> ids;
    for (const BudgetAnswer& answer : result_.search.answers) ids.insert(result_.space.candidates[answer.pick].id);
    for (const TuneRung& rung : result_.rungs) ids.insert(rung.setting);
    for (const SceneAnswer& answer : result_.scene_answers)
      if (answer.own) ids.insert(answer.own->setting);
    if (result_.pick) ids.insert(result_.pick->setting);
    if (result_.pick && !result_.pick->tie.empty()) ids.insert(result_.pick->tie);
    return ids;
  }

  void finish() {
    for (const std::string& id : answering_settings())
      for (std::size_t scene = 0; scene < config_.scenes.size(); ++scene) {
        const Case c = case_of(scene, setting_of(id));
        if (!book_->times(c.id()).empty()) whole_record(c, config_.scenes[scene]);
      }
    result_.wall_s = elapsed_s();
    write_results(config_, load_run(options_.output));
    write_atomically(options_.output / kTuneFile, tune_json(result_).dump(1) + "\n");
    write_info(true);
  }

  void write_info(bool finished) {
    SweepSummary summary{.folder = options_.output, .cases = static_cast<int>(settings_.size())};
    summary.bakes = library_.baked();
    summary.bakes_cached = library_.from_cache();
    summary.shaders = session_->shaders_compiled();
    summary.total_s = split_.total_seconds();
    summary.other_s = summary.total_s;
    for (std::size_t i = 0; i < kPartIds.size(); ++i) {
      summary.part_s.at(i) = split_.seconds(static_cast<Part>(i));
      summary.other_s -= summary.part_s.at(i);
    }
    nlohmann::json info = run_info(config_, {device_json(*session_)}, scenes_, summary, started_ns_, finished);
    if (is_bisected_) info[kBisectedKey] = *is_bisected_;
    store_->write_info(info);
  }

  const Config& config_;
  const TuneOptions& options_;
  Clock::time_point start_ = Clock::now();
  WallSplit split_;
  Plan plan_;
  Cache cache_;
  MapLibrary library_;
  std::vector<MeasuredScene> tuned_;  // one a scene of the config
  std::vector<MeasuredScene> holdout_;
  std::vector<MeasuredScene> scenes_;  // of this start and earlier ones
  std::vector<Settings> settings_;
  std::unique_ptr<Session> session_;
  std::unique_ptr<RunStore> store_;
  std::unique_ptr<RecordBook> records_;
  std::unique_ptr<Preparer> preparer_;
  std::unique_ptr<SampleBook> book_;
  std::unique_ptr<DeviceTimes> times_;
  std::vector<SettingScore> scores_;     // one a setting
  std::vector<std::size_t> candidates_;  // settings, in the order of the space
  double started_ns_ = 0;
  std::optional<bool> is_bisected_;  // once it is decided, by this start or an earlier one
  TuneResult result_;
};

}  // namespace

TuneResult run_tune(const Config& config, const TuneOptions& options) { return DeviceTuner(config, options).run(); }

}  // namespace reliefbench
