#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "tuner/decide/case_groups.h"
#include "tuner/decide/compare.h"
#include "tuner/decide/log_ratio.h"
#include "tuner/results/relative_time.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

constexpr double kClockRest_ns = 1e3;  // what the sum of two clocks may be off by

/// Where in the run's course a sample was drawn.
struct Place {
  int round = 0;
  int block = 0;
};

/// One backend's samples of one run, ready to be asked for a case's times.
class RunTimes {
 public:
  /// cases: ids of the backend's cases that are asked for
  RunTimes(const Run& run, const std::string& backend, std::span<const std::string> cases)
      : folder_(run.folder), samples_(group_samples(run.samples)) {
    if (const auto found = samples_.find(control_case_id(backend)); found != samples_.end()) control_ = found->second;
    place_samples(cases);
  }

  [[nodiscard]] const std::vector<Sample>& control() const { return control_; }

  [[nodiscard]] const std::vector<Sample>& samples(const Record& record) const {
    const auto found = samples_.find(record.case_id);
    if (found == samples_.end())
      fail_input("{}: no samples of case {}", (folder_ / "samples.jsonl").string(), record.case_id);
    return found->second;
  }

  [[nodiscard]] LoggedTimes of(const Record& record, bool relative) const {
    LoggedTimes times;
    const std::vector<Sample>& own = samples(record);
    for (const double time : relative ? relative_times(own, control_) : raw_times(own))
      times.logs.push_back(std::log(time));
    const std::vector<Place>& places = places_.at(record.case_id);
    for (const Place& place : places) times.rounds.push_back(place.round);
    times.block = places.front().block;
    return times;
  }

 private:
  /// A round draws each case of its block once; a block goes on to the next round when all were drawn.
  void place_samples(std::span<const std::string> cases) {
    std::vector<const Sample*> in_order;
    for (const std::string& id : cases)
      if (const auto found = samples_.find(id); found != samples_.end())
        for (const Sample& sample : found->second) in_order.push_back(&sample);
    std::ranges::stable_sort(in_order, [](const Sample* a, const Sample* b) { return is_drawn_before(*a, *b); });
    int round = -1;
    std::set<std::string_view> drawn;
    const Sample* before = nullptr;
    for (const Sample* sample : in_order) {
      if (before == nullptr || sample->part != before->part || sample->round != before->round ||
          drawn.contains(sample->case_id.text())) {
        ++round;
        drawn.clear();
      }
      drawn.insert(sample->case_id.text());
      std::vector<Place>& places = places_[sample->case_id];
      places.push_back({.round = round, .block = places.empty() ? round : places.front().block});
      before = sample;
    }
  }

  std::filesystem::path folder_;
  SamplesByCase samples_;
  std::vector<Sample> control_;
  std::map<std::string, std::vector<Place>, std::less<>> places_;
};

/// later_ns: by how much the clock of b is ahead
bool are_same(std::span<const Sample> a, std::span<const Sample> b, double later_ns) {
  return std::ranges::equal(a, b, [&](const Sample& x, const Sample& y) {
    return x.frame_time_ns == y.frame_time_ns && x.round == y.round && x.frames == y.frames &&
           std::abs(y.at_ns - x.at_ns - later_ns) <= kClockRest_ns;
  });
}

/// Whether a case's samples are the very same in two runs, and those of the control case beside them. A merged run has
/// the clock of its earliest part, and control samples of the others.
bool holds_same_samples(const RunTimes& base, std::span<const Sample> base_samples, const RunTimes& now,
                        std::span<const Sample> now_samples) {
  if (base_samples.empty() || now_samples.empty()) return false;
  const Sample& first = base_samples.front();
  const Sample& other = now_samples.front();
  const double later_ns = other.at_ns - first.at_ns;
  return are_same(base_samples, now_samples, later_ns) &&
         are_same(control_of_part(base.control(), first.part), control_of_part(now.control(), other.part), later_ns);
}

Change judge(const TimeChange& change, const CompareOptions& options) {
  const double upper = 1 + options.threshold;
  if (change.ratio.low >= 1 / upper && change.ratio.high <= upper) return Change::same;
  if (change.p > 1 - options.confidence) return Change::unclear;
  return change.ratio.ratio > 1 ? Change::slower : Change::faster;
}

TimeChange time_change(const LogRatio& ratio, const CompareOptions& options) {
  const double margin = ratio.margin(options.confidence);
  const LogRatio shift{.mean = 0, .error = ratio.shift, .df = ratio.df};
  return {.ratio = {.ratio = std::exp(ratio.mean),
                    .low = std::exp(ratio.mean - margin),
                    .high = std::exp(ratio.mean + margin)},
          .p = ratio.p(),
          .shift_margin = ratio.shift > 0 ? shift.margin(options.confidence) : 0};
}

/// Why a judged change is what it is, as far as its own interval says it.
Reason reason_of(const TimeChange& change, const CompareOptions& options) {
  if (change.change == Change::same)
    return change.ratio.low == change.ratio.high ? Reason::same_measurement : Reason::interval_within_threshold;
  if (change.change != Change::unclear) return Reason::beyond_chance;
  const double limit = std::log(1 + options.threshold);
  const double margin = std::log(change.ratio.high / change.ratio.low) / 2;
  if (change.ratio.low > 1 || change.ratio.high < 1) return Reason::chance_not_excluded;
  if (margin <= limit) return Reason::interval_spans_threshold;
  const bool is_shift = change.shift_margin > limit && change.shift_margin > margin / std::numbers::sqrt2;
  return is_shift ? Reason::shift_between_runs : Reason::too_few_samples;
}

std::vector<CaseTraits> traits_of(std::span<const CaseMatch> matches) {
  std::vector<CaseTraits> traits;
  for (const CaseMatch& match : matches) {
    const Record& record = *match.now;
    const auto format =
        std::ranges::find(record.params, "format", [](const auto& p) { return std::string_view(p.first); });
    traits.push_back({.technique = record.technique,
                      .map = record.map,
                      .format = format == record.params.end() ? std::string() : format->second});
  }
  return traits;
}

/// The mean over several devices' cases, each of which was estimated by itself.
LogRatio pooled(std::span<const LogRatio> devices, std::span<const std::size_t> cases) {
  double all = 0;
  for (const std::size_t n : cases) all += static_cast<double>(n);
  LogRatio whole{.mean = 0, .error = 0, .df = devices.front().df};
  double variance = 0;
  for (std::size_t i = 0; i < devices.size(); ++i) {
    const double share = static_cast<double>(cases[i]) / all;
    whole.mean += share * devices[i].mean;
    variance += share * share * devices[i].error * devices[i].error;
    whole.df = std::min(whole.df, devices[i].df);
  }
  whole.error = std::sqrt(variance);
  return whole;
}

class TimeComparison {
 public:
  TimeComparison(const Run& base, const Run& now, const CompareOptions& options, Comparison& comparison)
      : base_(base), now_(now), options_(options), comparison_(comparison) {}

  void add_backend(const std::string& backend, std::span<const CaseMatch> matches) {
    std::vector<std::string> old_ids;
    std::vector<std::string> new_ids;  // others where a scene goes by another name
    for (const CaseMatch& match : matches) {
      old_ids.push_back(match.base->case_id);
      new_ids.push_back(match.now->case_id);
    }
    const RunTimes before(base_, backend, old_ids);
    const RunTimes after(now_, backend, new_ids);
    const bool relative = uses_control(backend, before, after);
    std::vector<RatioCase> cases;
    for (const CaseMatch& match : matches)
      cases.push_back({.base = before.of(*match.base, relative),
                       .now = after.of(*match.now, relative),
                       .family = match.now->technique,
                       .is_same_measurement =
                           holds_same_samples(before, before.samples(*match.base), after, after.samples(*match.now))});
    const LogRatios ratios(cases);
    comparison_.between_runs.emplace_back(backend, ratios.between_runs());
    for (std::size_t i = 0; i < matches.size(); ++i) {
      comparison_.cases.push_back({time_change(ratios.of(std::vector{i}), options_), matches[i].base->case_id});
      comparison_.cases.back().backend = backend;
    }
    for (const auto& [name, members] : case_groups(traits_of(matches))) {
      GroupChange group{time_change(ratios.of(members), options_),
                        name.empty() ? backend : fmt::format("{} {}", backend, name), members.size()};
      group.backend = backend;
      for (const std::size_t i : members) group.case_ids.push_back(matches[i].base->case_id);
      comparison_.groups.push_back(std::move(group));
    }
    std::vector<std::size_t> all(matches.size());
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
    devices_.push_back(ratios.of(all));
    sizes_.push_back(all.size());
  }

  /// Corrects for how much was looked at, and judges.
  void finish() {
    // With one device the whole is that device's group, which is there already; with one case, that case.
    if (devices_.size() > 1 || comparison_.cases.size() == 1) {
      GroupChange all{time_change(pooled(devices_, sizes_), options_), "all", comparison_.cases.size()};
      for (const CaseChange& one : comparison_.cases) all.case_ids.push_back(one.case_id);
      if (devices_.size() == 1) all.backend = comparison_.cases.front().backend;
      comparison_.groups.insert(comparison_.groups.begin(), std::move(all));
    } else {
      comparison_.groups.front().group = "all";
    }
    const std::span<GroupChange> groups(comparison_.groups);
    correct(groups.first(1), 1.0 / 4);
    correct(groups.subspan(1), 1.0 / 4);
    correct(std::span(comparison_.cases), 1.0 / 2);
    std::ranges::stable_sort(comparison_.cases,
                             [](const CaseChange& a, const CaseChange& b) { return a.ratio.ratio > b.ratio.ratio; });
  }

 private:
  bool uses_control(const std::string& backend, const RunTimes& before, const RunTimes& after) {
    if (before.control().empty() || after.control().empty()) {
      if (options_.metric == "frame_time")
        comparison_.warnings.push_back(
            fmt::format("no control samples of {} in both runs: its times are compared raw, drift included", backend));
      return false;
    }
    const double ratio = median(control_times_ns(now_.info, backend, after.control())) /
                         median(control_times_ns(base_.info, backend, before.control()));
    comparison_.control_ratio.emplace_back(backend, ratio);
    if (options_.metric != "frame_time") return false;
    if (has_drifted(ratio))
      comparison_.warnings.push_back(
          fmt::format("the control case on {} takes {:.3f} times as long as in base: the device was in another state, "
                      "which ratios to the control case cancel only as far as all cases feel it alike",
                      backend, ratio));
    return true;
  }

  [[nodiscard]] bool has_drifted(double control_ratio) const {
    return std::abs(std::log(control_ratio)) > std::log(1 + options_.threshold);
  }

  /// How far the control case moved, as a log, where that is beyond the threshold; else 0.
  [[nodiscard]] double control_drift(const TimeChange& change) const {
    double drift = 0;
    for (const auto& [backend, ratio] : comparison_.control_ratio)
      if ((change.backend.empty() || change.backend == backend) && has_drifted(ratio))
        drift = std::max(drift, std::abs(std::log(ratio)));
    return drift;
  }

  /// Takes into account what a change rests on besides its own interval. Where the control case moved, a ratio to it
  /// that is no larger than that move may be what the cases felt of it otherwise.
  void add_doubts(TimeChange& change) const {
    change.reason = reason_of(change, options_);
    if (change.reason != Reason::beyond_chance) return;
    if (const double drift = control_drift(change); drift > 0) {
      change.reason = Reason::control_drift;
      if (options_.metric == "frame_time" && std::abs(std::log(change.ratio.ratio)) <= drift)
        change.change = Change::unclear;
    } else if (!comparison_.drivers.empty()) {
      change.reason = Reason::different_driver;
    }
  }

  /// Holm's correction within one of three questions: whole, groups, cases. Each has a fixed share of the chance of a
  /// false alarm, so that the whole does not pay for the count of the cases.
  template <typename T>
  void correct(std::span<T> changes, double share) const {
    std::vector<double> p_values;
    for (const TimeChange& change : changes) p_values.push_back(change.p);
    const std::vector<double> corrected = holm(p_values);
    for (std::size_t i = 0; i < changes.size(); ++i) {
      changes[i].p = std::min(1.0, corrected[i] / share);
      changes[i].change = judge(changes[i], options_);
      add_doubts(changes[i]);
    }
  }

  const Run& base_;
  const Run& now_;
  const CompareOptions& options_;
  Comparison& comparison_;
  std::vector<LogRatio> devices_;
  std::vector<std::size_t> sizes_;
};

}  // namespace

void compare_times(const Run& base, const Run& now, std::span<const CaseMatch> matches, const CompareOptions& options,
                   Comparison& comparison) {
  std::map<std::string, std::vector<CaseMatch>> backends;
  for (const CaseMatch& match : matches) backends[match.base->backend].push_back(match);
  TimeComparison times(base, now, options, comparison);
  for (const auto& [backend, own] : backends) times.add_backend(backend, own);
  times.finish();
  comparison.assumed.push_back(
      options.metric == "frame_time"
          ? "what slows the whole device between or within the runs slows the control case by the same ratio"
          : "the device was in the same state in both runs: raw times take drift for a change");
  comparison.assumed.push_back(
      "what shifts the times of a case from run to run without a cause shifts those of its block alike, and is as "
      "large "
      "as the other cases of its technique show (between_runs)");
}

}  // namespace reliefbench
