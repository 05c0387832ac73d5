#include <algorithm>
#include <limits>
#include <memory>
#include <numeric>
#include <set>

#include "kernels/base/atomic_file.h"
#include "kernels/base/error.h"
#include "kernels/base/json_file.h"
#include "tuner/decide/pareto.h"
#include "tuner/decide/recommend.h"
#include "tuner/measure/progress.h"
#include "tuner/measure/run_results.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/budgets.h"
#include "tuner/results/json_text.h"
#include "tuner/results/run_files.h"
#include "tuner/tune/tune_run.h"
#include "tuner/tune/tune_search.h"
#include "tuner/tune/tuner.h"

namespace reliefbench {
namespace {

constexpr double kMostOfErrorPass = 0.6;      // of the time that is left when it begins: then it is cut off
constexpr double kMuchOfErrorPass = 1 / 3.0;  // of the time limit: rather bisect, where that is possible

bool compares_pictures(const std::vector<Budget>& budgets, std::string_view error_metric) {
  return find_metric(error_metric).compares_pictures ||
         std::ranges::any_of(budgets, [](const Budget& b) { return find_metric(b.metric).compares_pictures; });
}

/// A device. Cases are settings in scenes, both by index.
class DeviceSource final : public TuneSource {
 public:
  DeviceSource(const Config& config, const TuneOptions& options, TuneClock& clock)
      : options_(options),
        clock_(clock),
        run_(config, options),
        config_(run_.config()),
        settings_(run_.settings()),
        all_scenes_(config_.scenes.size()) {
    std::iota(all_scenes_.begin(), all_scenes_.end(), std::size_t{0});
  }

  /// The error pass.
  void score_settings() {
    Progress& progress = run_.progress();
    for (const std::string& reading : run_.library().readings()) progress.note("read " + reading);
    if (!run_.frame_choice().empty()) progress.note(run_.frame_choice());
    const bool pictures = compares_pictures(asked(), config_.front_error);
    const auto judge = [&](std::size_t setting, std::size_t scene) {
      try {
        return run_.score(case_of(scene, setting), config_.scenes[scene], pictures);
      } catch (const Error& error) {
        if (run_.is_lost(error.fault())) run_.reopen();
        throw;
      }
    };
    const double begun_s = clock_.elapsed_s();  // the audit has had its time by then
    const double until_s = begun_s + kMostOfErrorPass * (clock_.limit_s() - begun_s);
    const auto should_stop = [&, until_s](std::size_t done) {
      progress.update(static_cast<double>(done) / static_cast<double>(settings_.size()),
                      fmt::format("errors of {} settings", settings_.size()));
      return clock_.is_over(until_s);
    };
    ErrorPass pass(settings_, config_.scenes.size(), {.judge = judge, .should_stop = should_stop});
    const double whole_s = pass.score_coarse();
    if (run_.is_bisected()) {
      counts_.is_bisected = *run_.is_bisected();  // or the settings to search would be others than they were
    } else if (has_one_answer(options_.question) && options_.time_limit_s) {
      counts_.is_bisected = whole_s > kMuchOfErrorPass * clock_.limit_s();
      if (counts_.is_bisected)
        progress.note(fmt::format("all errors would take {:.0f} s of {:.0f} s: bisecting along the step counts",
                                  whole_s, clock_.limit_s()));
    }
    if (!options_.is_interrupted()) run_.set_bisected(counts_.is_bisected);
    run_.write_info(false);
    if (counts_.is_bisected)
      pass.bisect([&](const FrameScore& score) { return meets_asked(score); });
    else
      pass.score_rest();
    scores_ = pass.take();
    progress.finish();
    counts_.settings = static_cast<int>(settings_.size());
    counts_.conflicts = static_cast<int>(run_.conflicts());
    for (const SettingScore& score : scores_) {
      counts_.scored += score.scored == Scored::yes ? 1 : 0;
      counts_.assumed += score.scored == Scored::assumed ? 1 : 0;
      counts_.hopeless += score.scored == Scored::hopeless ? 1 : 0;
      counts_.failed += score.scored == Scored::failed ? 1 : 0;
      counts_.unscored += score.scored == Scored::no ? 1 : 0;
    }
  }

  TuneResult blank() const override {
    TuneResult result{.error_metric = config_.front_error,
                      .constraints = config_.front_constraints,
                      .backend = options_.backend,
                      .device = run_.device().name,
                      .filter = run_.filter(),
                      .frame_notes = run_.frame_notes(),
                      .counts = counts_};
    for (const MeasuredScene& scene : run_.tuned()) {
      result.scenes.push_back(scene.spec.id);
      result.subjects.push_back(scene_description(scene.spec));
      result.scene_keys.push_back(scene.key);
    }
    return result;
  }

  std::optional<double> asked_error() const override { return limit_on(config_.front_error, config_.budgets); }

  SearchSpace space(std::span<const std::size_t> scenes) override {
    SearchSpace space = empty_setting_space();
    const std::vector<const MetricRow*> work = work_metrics();
    candidates_.clear();
    for (std::size_t setting = 0; setting < settings_.size(); ++setting) {
      const std::optional<double> error = worst_error(setting, scenes);
      if (!error) continue;
      candidates_.push_back(setting);
      Candidate candidate = candidate_of(settings_[setting], setting_id(settings_[setting]));
      candidate.error = *error;
      for (const std::size_t scene : scenes) {
        const FrameScore& score = scores_[setting].scores[scene];
        candidate.is_feasible &= meets_asked(score);
        for (std::size_t i = 0; i < work.size(); ++i)
          candidate.work[i] = combined(options_.combine, candidate.work[i], weight_of(scene, scenes),
                                       work[i]->value(score).value_or(0));
      }
      space.candidates.push_back(std::move(candidate));
    }
    drop_unused_axes(space);
    return space;
  }

  std::unique_ptr<TimeSource> times(std::span<const std::size_t> scenes) override {
    std::vector<BookSource::Scene> list;
    for (const std::size_t scene : scenes) {
      BookSource::Scene& entry = list.emplace_back();
      entry.weight = weight_of(scene, scenes);
      for (const std::size_t setting : candidates_) entry.case_ids.push_back(case_of(scene, setting).id());
    }
    const auto draw = [this,
                       of = std::vector(scenes.begin(), scenes.end())](std::span<const BookSource::Wanted> round) {
      std::vector<TuneRun::Wanted> wanted;
      for (const auto& [scene, candidate] : round)
        wanted.push_back({.spec = case_of(of[scene], candidates_[candidate]), .scene = &config_.scenes[of[scene]]});
      run_.draw(wanted);
    };
    return std::make_unique<BookSource>(run_.book(), std::move(list), options_.combine, draw);
  }

  /// Of the map as it is uploaded, whether or not this start has done so yet.
  std::int64_t memory_bytes(std::size_t scene, std::size_t candidate) override {
    const std::optional<MapTextures> map =
        run_.library().packed(settings_[candidates_[candidate]], config_.scenes[scene]);
    return map ? static_cast<std::int64_t>(map->bytes()) : 0;
  }

  std::vector<double> times_ns(std::size_t scene, const std::string& setting) const override {
    return run_.book().times(case_of(scene, setting_of(setting)).id());
  }

  std::pair<std::string, std::string> nearest() const override {
    double least = std::numeric_limits<double>::infinity();
    std::pair<std::string, std::string> nearest;
    for (std::size_t i = 0; i < settings_.size(); ++i) {
      if (!worst_error(i, all_scenes_)) continue;
      Miss worst;
      for (const FrameScore& score : scores_[i].scores) {
        Miss here = miss_of(asked(), score);
        if (here.worst >= worst.worst) worst = std::move(here);
      }
      if (worst.worst >= least) continue;
      least = worst.worst;
      nearest = {setting_id(settings_[i]), worst.text};
    }
    return nearest;
  }

  TunePlace place() const override {
    const MeasuredScene& scene = run_.tuned().front();
    return {.device = measured_device(info(), options_.backend, run_.device().name),
            .scene = scene.spec.id,
            .scene_key = scene.key};
  }

  FleetRun timed_run() override {
    const TunePlace here = place();
    FleetRun run{.name = options_.output.string(), .rows = {}, .info = info()};
    const CoarseFilter filter = run_.filter();
    for (std::size_t candidate = 0; candidate < candidates_.size(); ++candidate) {
      const std::size_t setting = candidates_[candidate];
      const Case c = case_of(0, setting);
      const std::vector<double>& times = run_.book().times(c.id());
      if (times.size() < kLeastTold) continue;
      TableRow row{.case_id = c.id(),
                   .settings = c.settings,
                   .map = std::string(map_of(c.settings).id),
                   .backend = options_.backend,
                   .device = here.device.device,
                   .driver = here.device.driver,
                   .machine = here.device.machine,
                   .scene = here.scene,
                   .scene_key = here.scene_key,
                   .reason = {},
                   .errors = std::vector<std::optional<double>>(metrics().size()),
                   .coarse_filter = filter.error_of(c.settings),
                   .memory_bytes = memory_bytes(0, candidate),
                   .frame_time = {},
                   .samples_ns = times};
      std::ranges::transform(metrics(), row.errors.begin(),
                             [&](const MetricRow& metric) { return metric.value(scores_[setting].scores.front()); });
      run.rows.push_back(std::move(row));
    }
    return run;
  }

  Progress& progress() override { return run_.progress(); }

  void take_failure(const CaseFailed& failed, bool is_left_out) override {
    run_.take_failure(failed);
    if (!is_left_out) return;
    scores_[setting_of(setting_id(parse_setting(failed.record.case_id)))] = {.scored = Scored::failed,
                                                                             .failure = failed.record.reason};
  }

  /// Tries the pick on the held-out scenes.
  void try_holdout(TuneResult& result) {
    const std::vector<Budget>& budgets = options_.question.max_error.empty() ? config_.budgets : asked();
    for (const MeasuredScene& held_out : run_.holdout()) {
      const SceneSpec& scene = held_out.spec;
      const Case c{.settings = parse_setting(result.pick->setting), .scene_id = scene.id, .backend = options_.backend};
      const std::string id = c.id();
      HoldoutAnswer answer{.scene = scene.id, .scene_key = held_out.key};
      try {
        if (const Record* const record = run_.given_up(id)) throw CaseFailed(*record);
        const TuneRun::Wanted wanted{.spec = c, .scene = &scene};
        while (static_cast<int>(run_.book().times(id).size()) < config_.measure.samples) run_.draw({&wanted, 1});
        const Record& record = run_.whole_record(c, scene);
        answer.failure = record.reason;
        if (record.error) {
          answer.error = find_metric(config_.front_error).value(*record.error);
          answer.miss = miss_of(budgets, *record.error).text;
          answer.time_ns = median(run_.book().times(id));
        }
      } catch (const CaseFailed& failed) {
        run_.take_failure(failed);
        answer.failure = failed.record.reason;
      }
      result.holdout.push_back(std::move(answer));
    }
  }

  /// Enters the settings that answer, and leaves a whole run.
  void finish(TuneResult& result) {
    for (const std::string& id : answering_settings(result))
      for (std::size_t scene = 0; scene < config_.scenes.size(); ++scene) {
        const Case c = case_of(scene, setting_of(id));
        if (!run_.book().times(c.id()).empty()) run_.whole_record(c, config_.scenes[scene]);
      }
    result.wall_s = clock_.elapsed_s();
    const Run run = load_run(options_.output);
    run_.write_pictures(run);
    run_.progress().finish();
    write_results(config_, run);
    write_atomically(options_.output / kTuneFile, json_text(tune_json(result), 1) + "\n");
    run_.write_info(true);
  }

 private:
  [[nodiscard]] nlohmann::json info() const { return read_json(options_.output / kRunFile); }
  [[nodiscard]] Case case_of(std::size_t scene, std::size_t setting) const {
    return {.settings = settings_[setting], .scene_id = config_.scenes[scene].id, .backend = options_.backend};
  }
  [[nodiscard]] const std::vector<Budget>& asked() const {
    return options_.question.max_error.empty() ? config_.front_constraints : options_.question.max_error;
  }
  [[nodiscard]] bool meets_asked(const FrameScore& score) const {
    return std::ranges::all_of(asked(), [&](const Budget& budget) { return meets(score, budget); });
  }

  /// Of the front's metric, in the worst of these scenes; none where the setting was not scored, or has no value in
  /// one.
  [[nodiscard]] std::optional<double> worst_error(std::size_t setting, std::span<const std::size_t> scenes) const {
    if (scores_[setting].scored != Scored::yes) return std::nullopt;
    const MetricRow& metric = find_metric(config_.front_error);
    double worst = 0;
    for (const std::size_t scene : scenes) {
      const std::optional<double> error = metric.value(scores_[setting].scores[scene]);
      if (!error) return std::nullopt;
      worst = std::max(worst, *error);
    }
    return worst;
  }

  [[nodiscard]] std::size_t setting_of(const std::string& id) const {
    return static_cast<std::size_t>(std::ranges::find(settings_, id, [](const Settings& s) { return setting_id(s); }) -
                                    settings_.begin());
  }

  [[nodiscard]] double weight_of(std::size_t scene, std::span<const std::size_t> scenes) const {
    return scenes.size() == 1 || options_.weights.empty() ? 1 : options_.weights[scene];
  }

  /// Settings that an answer names: these get a whole record, with pictures.
  [[nodiscard]] static std::set<std::string> answering_settings(const TuneResult& result) {
    std::set<std::string> ids;
    for (const BudgetAnswer& answer : result.search.answers) ids.insert(result.space.candidates[answer.pick].id);
    for (const TuneRung& rung : result.rungs) ids.insert(rung.setting);
    for (const SceneAnswer& answer : result.scene_answers)
      if (answer.own) ids.insert(answer.own->setting);
    if (result.pick) ids.insert(result.pick->setting);
    if (result.pick && !result.pick->tie.empty()) ids.insert(result.pick->tie);
    if (result.fleet) ids.insert(setting_id(result.fleet->fleet.settings.front().settings));
    return ids;
  }

  const TuneOptions& options_;
  TuneClock& clock_;
  TuneRun run_;
  const Config& config_;
  const std::vector<Settings>& settings_;
  std::vector<std::size_t> all_scenes_;
  std::vector<SettingScore> scores_;     // one a setting
  std::vector<std::size_t> candidates_;  // settings, in the order of the space
  TuneCounts counts_;
};

}  // namespace

TuneResult run_tune(const Config& config, const TuneOptions& options) {
  TuneClock clock(options);
  DeviceSource device(config, options, clock);
  std::optional<MatchedFleet> fleet = match_fleet(device, options);
  device.score_settings();
  TuneResult result = tune(device, options, clock, std::move(fleet));
  if (result.pick) device.try_holdout(result);
  device.finish(result);
  return result;
}

}  // namespace reliefbench
