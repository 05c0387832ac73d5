#include "tuner/measure/require_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include "kernels/base/error.h"
#include "tuner/measure/attempt.h"
#include "tuner/measure/frame_size.h"
#include "tuner/measure/prepare.h"
#include "tuner/measure/progress.h"
#include "tuner/measure/require_space.h"
#include "tuner/measure/timed_in_turns.h"

namespace reliefbench {
namespace {

constexpr double kUndrawable = std::numeric_limits<double>::infinity();  // the error of what can't be drawn

/// Draws and times settings of one scene on one device.
class SceneStudy {
 public:
  SceneStudy(SceneFile file, const RequireOptions& options)
      : file_(std::move(file)),
        options_(options),
        cache_(Cache::open()),
        library_(cache_, split_),
        metric_(find_metric(file_.visible.metric)),
        progress_(options.quiet),
        session_(find_backend(options.backend), options.device, split_,
                 {.audits = audits_for(is_by_compute(file_.setting)),
                  .open = options.open,
                  .timeout_s = file_.measure.timeout_s}),
        preparer_({.session = session_,
                   .library = library_,
                   .cache = cache_,
                   .split = split_,
                   .timeout_s = file_.measure.timeout_s,
                   .flicker_frames = file_.measure.flicker_frames,
                   .seen_features = exact_features()}) {
    for (const SceneSpec& scene : file_.scenes)
      if (is_solid(scene.heightmap))
        fail_input("{}: light and depth of a solid, a heightmap of two heights a texel, are not traced", scene.id);
    session_.calibrate(file_.measure.batch_ms, nullptr);
    if (!has_default_frames(file_.scenes)) return;
    const DefaultFrame frame = default_frame({&session_.device(), 1});
    set_default_frames(file_.scenes, frame);
    progress_.note(frame.why);
  }

  RequireReport run() {
    RequireReport report{.file = file_,
                         .views = library_.measured(file_.scenes),
                         .backend = session_.device().backend,
                         .device = session_.device().name,
                         .is_software = session_.device().software,
                         .timer = std::string(timer_id(session_.calibration().timer))};
    const auto error_of = [&](const Settings& settings) { return worst_of(settings).first; };
    const SettingSpace made = setting_space(file_, error_of, report.rows);
    std::erase_if(report.rows, [](const TriedRow& row) { return row.value == kUndrawable; });
    for (TriedRow& row : report.rows) row.value = value_of(row.value);
    report.features = made.space.features;
    report.sets = made.space.sets.size();
    std::size_t judged = 0;
    const SetError error = [&](FeatureSet set) {
      const auto [worst, view] = worst_of(made.at(set));
      if (worst != kUndrawable)
        report.seen.push_back({.set = set, .settings = made.at(set), .value = value_of(worst), .view = view});
      progress_.update(0.8 * static_cast<double>(++judged) / static_cast<double>(report.sets),
                       fmt::format("sets of features on {}", report.device));
      return worst;
    };
    answer(made, error, report);
    for (std::size_t i = 0; i < report.features.size(); ++i) add_worth(made, error, i, report);
    std::vector<FeatureSet> timed = {report.answer};
    for (const FeatureWorth& one : report.worth)
      for (const FeatureSet set : {one.with, one.without})
        if (std::ranges::find(timed, set) == timed.end()) timed.push_back(set);
    const Times times = time_sets(made, timed, report.times_held_back);
    if (report.times_held_back.empty()) {
      report.frame_time_ns = summarise(times.at(report.answer));
      for (FeatureWorth& one : report.worth) one.price_ns = difference(times, one.with, one.without);
    }
    if (options_.has_pictures)
      for (FeatureWorth& one : report.worth) draw(made, report, one);
    report.failed = std::move(failed_);
    progress_.finish();
    return report;
  }

 private:
  using Times = std::map<FeatureSet, std::vector<double>>;  ///< ns a frame, the mean over the views, a value a round

  /// Errors rise where values get worse.
  [[nodiscard]] double error_of(double value) const { return metric_.lower_is_better ? value : -value; }
  [[nodiscard]] double value_of(double error) const { return error_of(error); }

  Case case_of(const Settings& settings, const SceneSpec& scene) const {
    return {.settings = settings, .scene_id = scene.id, .backend = options_.backend};
  }

  /// The error of a setting's picture, and the view where it is that.
  std::pair<double, std::size_t> worst_of(const Settings& settings) {
    const auto known = known_.find(settings.text() + std::string(settings.technique().id));
    if (known != known_.end()) return known->second;
    std::pair<double, std::size_t> worst{-std::numeric_limits<double>::infinity(), 0};
    for (std::size_t view = 0; view < file_.scenes.size(); ++view) {
      const Case c = case_of(settings, file_.scenes[view]);
      FrameScore score;
      const std::string failure = tried([&] {
        const PreparedCase prepared = preparer_.prepare(c, file_.scenes[view]);
        check(prepared);
        score = *prepared.record.error;
      });
      if (!failure.empty()) {
        failed_.push_back({.settings = settings, .reason = fmt::format("{}: {}", c.scene_id, failure)});
        worst = {kUndrawable, view};
        break;
      }
      const std::optional<double> value = metric_.value(score);
      if (!value)
        fail_input("{}: {} has no value in {} (flicker needs measure.flicker_frames, every metric a ray)",
                   file_.path.string(), metric_.id, c.scene_id);
      if (error_of(*value) > worst.first) worst = {error_of(*value), view};
    }
    return known_[settings.text() + std::string(settings.technique().id)] = worst;
  }

  static void check(const PreparedCase& prepared) {
    if (prepared.record.status != Status::ok) throw CaseFailed(prepared.record);
  }

  std::string tried(const std::function<void()>& work) {
    return attempt(session_, work, [&] { preparer_.release(); });
  }

  void answer(const SettingSpace& made, const SetError& error, RequireReport& report) {
    report.is_exhaustive = options_.search == RequireSearch::exhaustive ||
                           (options_.search == RequireSearch::automatic && report.sets <= kMostEnumerated);
    const double limit = error_of(file_.visible.limit);
    const Required required = report.is_exhaustive ? require_by_enumeration(made.space, error, limit)
                                                   : require_greedily(made.space, error, limit);
    report.ties = required.smallest;
    report.is_met = !report.ties.empty();
    if (!report.is_met) {
      const JudgedSet& nearest = *std::ranges::min_element(required.judged, {}, &JudgedSet::error);
      if (nearest.error == kUndrawable) fail_environment("no set of features can be drawn: {}", failed_.front().reason);
      report.answer = nearest.set;
    } else if (report.ties.size() == 1) {
      report.answer = report.ties.front();
    } else {
      const Times times = time_sets(made, report.ties, report.ties_held_back);
      report.answer = report.ties.front();
      if (report.ties_held_back.empty())
        report.answer =
            *std::ranges::min_element(report.ties, {}, [&](FeatureSet set) { return median(times.at(set)); });
    }
  }

  /// The sets that tell what a feature is worth; no worth of one that no set has beside the answer.
  void add_worth(const SettingSpace& made, const SetError& error, std::size_t feature, RequireReport& report) {
    FeatureWorth worth{.name = report.features[feature],
                       .choice = made.choices[feature],
                       .is_needed = report.is_met && has(report.answer, feature),
                       .without = report.answer,
                       .with = report.answer};
    const bool is_in = has(report.answer, feature);
    const std::optional<FeatureSet> other =
        is_in ? largest_without(made.space, report.answer, feature) : smallest_with(made.space, report.answer, feature);
    if (!other) return;
    (is_in ? worth.without : worth.with) = *other;
    const bool is_seen = std::ranges::find(report.seen, *other, &SeenSet::set) != report.seen.end();
    if (!is_seen && error(*other) == kUndrawable) return;
    report.worth.push_back(std::move(worth));
  }

  /// Frame times of sets in turns, in rounds of all of them in all views; none where the device was held back.
  Times time_sets(const SettingSpace& made, const std::vector<FeatureSet>& sets, std::string& held_back) {
    Times times;
    const std::string failure = tried([&] { times = draw_sets(made, sets, held_back); });
    if (!failure.empty()) fail_environment("frames can't be timed: {}", failure);
    return times;
  }

  Times draw_sets(const SettingSpace& made, const std::vector<FeatureSet>& sets, std::string& held_back) {
    std::vector<Case> cases;
    for (const FeatureSet set : sets)
      for (const SceneSpec& scene : file_.scenes) cases.push_back(case_of(made.at(set), scene));
    std::vector<PreparedCase> prepared;
    for (std::size_t i = 0; i < cases.size(); ++i) {
      prepared.push_back(preparer_.prepare_to_time(cases[i], file_.scenes[i % file_.scenes.size()]));
      check(prepared.back());
    }
    std::vector<TimedCase> timed;
    timed.reserve(prepared.size());
    for (const PreparedCase& one : prepared) timed.push_back({.record = &one.record, .draws = one.draws});
    const TimesInTurns drawn = timed_in_turns(
        {.session = session_,
         .measure = file_.measure,
         .split = split_,
         .progress = progress_,
         .cooling_pause_s = options_.cooling_pause_s},
        timed, [&](int round) { progress_.update(0.8 + 0.2 * round / file_.measure.samples, "frame times"); });
    held_back = drawn.held_back;
    Times times;
    for (std::size_t i = 0; i < drawn.times_ns.size(); ++i) {
      const std::vector<double>& own = drawn.times_ns[i];
      std::vector<double>& all = times[sets[i / file_.scenes.size()]];
      all.resize(own.size());
      for (std::size_t round = 0; round < own.size(); ++round)
        all[round] += own[round] / static_cast<double>(file_.scenes.size());
    }
    return times;
  }

  static Summary difference(const Times& times, FeatureSet with, FeatureSet without) {
    std::vector<double> differences = times.at(with);
    for (std::size_t i = 0; i < differences.size(); ++i) differences[i] -= times.at(without)[i];
    return summarise(differences);
  }

  void draw(const SettingSpace& made, const RequireReport& report, FeatureWorth& worth) {
    const SceneSpec& scene = file_.scenes[report.at(worth.without).view];
    const std::string failure = tried([&] {
      CasePictures without = preparer_.pictures(case_of(made.at(worth.without), scene), scene);
      CasePictures with = preparer_.pictures(case_of(made.at(worth.with), scene), scene);
      worth.pictures = {
          .without = std::move(without.frame), .with = std::move(with.frame), .reference = std::move(with.reference)};
    });
    if (!failure.empty()) progress_.note(fmt::format("no pictures of {}: {}", worth.name, failure));
  }

  SceneFile file_;
  const RequireOptions& options_;
  WallSplit split_;
  Cache cache_;
  MapLibrary library_;
  const MetricRow& metric_;
  Progress progress_;
  Session session_;
  Preparer preparer_;
  std::map<std::string, std::pair<double, std::size_t>> known_;
  std::vector<FailedSetting> failed_;
};

}  // namespace

const SeenSet& RequireReport::at(FeatureSet set) const { return *std::ranges::find(seen, set, &SeenSet::set); }

std::vector<std::string> RequireReport::names(FeatureSet set) const {
  std::vector<std::string> list;
  for (std::size_t i = 0; i < features.size(); ++i)
    if (has(set, i)) list.push_back(features[i]);
  return list;
}

RequireReport run_require(const SceneFile& file, const RequireOptions& options) {
  return SceneStudy(file, options).run();
}

}  // namespace reliefbench
