#include "tuner/decide/fleet.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>

#include "kernels/base/error.h"
#include "tuner/decide/choose.h"
#include "tuner/plan/setting_names.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/budgets.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

/// A setting in a place.
struct FleetTime {
  const TableRow* row = nullptr;
  double log_time = 0;
  double variance = 0;  ///< of log_time
  int df = 0;
  double low = 0;  ///< of log_time, all at once
  double high = 0;
};

/// The settings of a place that are within the budgets, by id.
using PlaceTimes = std::map<std::string, FleetTime>;

bool is_within(const TableRow& row, std::span<const Budget> budgets) {
  const auto value_of = [&](const Budget& budget) { return row.errors[find_metric(budget.metric).place]; };
  return row.status == Status::ok && miss_of(budgets, value_of).text.empty();
}

FleetTime time_of(const TableRow& row, std::string_view run) {
  if (row.samples_ns.size() < 2)
    fail_input("{}: case '{}' has {} samples; at least two say how sure a time is", run, row.case_id,
               row.samples_ns.size());
  std::vector<double> logs;
  for (const double time : row.samples_ns) logs.push_back(std::log(time));
  const Location location = huber_location(logs);
  const auto n = static_cast<double>(logs.size());
  double squares = 0;
  for (const double influence : location.influence) squares += influence * influence;
  return {.row = &row,
          .log_time = location.value,
          .variance = squares / (n * (n - 1)),
          .df = static_cast<int>(logs.size()) - 1};
}

/// Each time's interval, such that `count` of them hold at once.
void set_intervals(PlaceTimes& times, double confidence, std::size_t count) {
  std::vector<double> variances;
  std::vector<int> df;
  for (const auto& [id, time] : times) {
    variances.push_back(time.variance * static_cast<double>(time.row->samples_ns.size()));
    df.push_back(time.df);
  }
  const VariancePrior prior = variance_prior(variances, df);
  for (auto& [id, time] : times) {
    const auto n = static_cast<double>(time.row->samples_ns.size());
    const double variance = prior.moderated(time.variance * n, time.df) / n;
    const double all_df = std::min<double>(prior.df + time.df, kMostDf);
    const double t = student_t_quantile((1 - confidence) / static_cast<double>(count), static_cast<int>(all_df));
    time.low = time.log_time - t * std::sqrt(variance);
    time.high = time.log_time + t * std::sqrt(variance);
  }
}

/// Where the time of a place's best lies, and which setting it is.
struct BestTime {
  const FleetTime* time = nullptr;
  double low = 0;
  double high = 0;
};
BestTime best_of(const PlaceTimes& times) {
  BestTime best;
  for (const auto& [id, time] : times) {
    if (best.time == nullptr) best = {.time = &time, .low = time.low, .high = time.high};
    if (time.log_time < best.time->log_time) best.time = &time;
    best.low = std::min(best.low, time.low);
    best.high = std::min(best.high, time.high);
  }
  return best;
}

Loss loss_of(const FleetTime& time, const BestTime& best) {
  return {.value = std::expm1(time.log_time - best.time->log_time),
          .low = std::max(0.0, std::expm1(time.low - best.high)),
          .high = std::expm1(time.high - best.low),
          .time_ns = median(time.row->samples_ns)};
}

/// The places of the runs with what is within the budgets there.
class FleetTimes {
 public:
  FleetTimes(std::span<const FleetRun> runs, const FleetOptions& options) {
    for (std::size_t i = 0; i < runs.size(); ++i)
      for (const TableRow& row : runs[i].rows) add(row, i, runs, options.budgets);
    std::size_t count = 0;
    for (const PlaceTimes& times : times_) count += times.size();
    for (std::size_t p = 0; p < places_.size(); ++p) {
      places_[p].settings = times_[p].size();
      set_intervals(times_[p], options.confidence, count);
      bests_.push_back(best_of(times_[p]));
    }
  }

  [[nodiscard]] const std::vector<FleetPlace>& places() const { return places_; }
  [[nodiscard]] std::optional<Loss> loss(const std::string& setting, std::size_t place) const {
    const auto found = times_[place].find(setting);
    return found == times_[place].end() ? std::nullopt : std::optional(loss_of(found->second, bests_[place]));
  }
  [[nodiscard]] const PlaceTimes& in(std::size_t place) const { return times_[place]; }
  [[nodiscard]] const TableRow& best(std::size_t place) const { return *bests_[place].time->row; }

 private:
  void add(const TableRow& row, std::size_t run, std::span<const FleetRun> runs, std::span<const Budget> budgets) {
    const auto is_it = [&](const FleetPlace& place) {
      return place.backend == row.backend && place.device == row.device && place.scene_key == row.scene_key &&
             place.scene == row.scene;
    };
    const auto found = std::ranges::find_if(places_, is_it);
    const auto index = static_cast<std::size_t>(found - places_.begin());
    if (found == places_.end()) {
      places_.push_back({.run = run,
                         .backend = row.backend,
                         .device = row.device,
                         .scene = row.scene,
                         .scene_key = row.scene_key,
                         .weight = runs[run].weight});
      times_.emplace_back();
    } else if (found->run != run) {
      fail_input("{} and {} both hold {}: give one of them", runs[found->run].name, runs[run].name, place_text(*found));
    }
    if (is_within(row, budgets)) times_[index].emplace(setting_id(row.settings), time_of(row, runs[run].name));
  }

  std::vector<FleetPlace> places_;
  std::vector<PlaceTimes> times_;
  std::vector<BestTime> bests_;
};

/// What leaves nothing to choose from.
[[noreturn]] void fail_without_setting(const FleetTimes& times, const FleetOptions& options) {
  const auto& places = times.places();
  const auto fewest = std::ranges::min_element(places, {}, &FleetPlace::settings);
  const std::string within = fmt::format("{}", fmt::join(budget_texts(options.budgets), " and "));
  if (fewest->settings == 0)
    throw Error(Exit::answer_is_no, fmt::format("nothing meets {} on {}", within, place_text(*fewest)));
  throw Error(Exit::answer_is_no,
              fmt::format("no setting was measured and meets {} in all {} places; the fewest, {}, do "
                          "on {}",
                          within, places.size(), fewest->settings, place_text(*fewest)));
}

std::vector<FleetSetting> common_settings(const FleetTimes& times, const FleetOptions& options) {
  std::vector<FleetSetting> settings;
  for (const auto& [id, time] : times.in(0)) {
    FleetSetting one{
        .settings = time.row->settings, .losses = {}, .combined = {}, .memory_bytes = time.row->memory_bytes};
    for (std::size_t p = 0; p < times.places().size(); ++p)
      if (const std::optional<Loss> loss = times.loss(id, p)) one.losses.push_back(*loss);
    if (one.losses.size() < times.places().size()) continue;
    one.combined = combined_loss(one.losses, times.places(), options.regret);
    settings.push_back(std::move(one));
  }
  return settings;
}

nlohmann::json loss_json(const Loss& loss) {
  return {{"loss", loss.value}, {"interval", {loss.low, loss.high}}, {"time_ns", loss.time_ns}};
}

}  // namespace

Loss combined_loss(std::span<const Loss> losses, std::span<const FleetPlace> places, Regret regret) {
  Loss combined;
  if (regret == Regret::minimax) {
    for (const Loss& loss : losses) {
      combined.value = std::max(combined.value, loss.value);
      combined.low = std::max(combined.low, loss.low);
      combined.high = std::max(combined.high, loss.high);
    }
    return combined;
  }
  double weights = 0;
  for (const FleetPlace& place : places) weights += place.weight;
  for (std::size_t i = 0; i < losses.size(); ++i) {
    const double share = places[i].weight / weights;
    combined.value += share * losses[i].value;
    combined.low += share * losses[i].low;
    combined.high += share * losses[i].high;
  }
  return combined;
}

std::string place_text(const FleetPlace& place) {
  return fmt::format("{} {} in {}", place.backend, place.device, place.scene);
}

Fleet choose_for_fleet(std::span<const FleetRun> runs, const FleetOptions& options) {
  const FleetTimes times(runs, options);
  if (times.places().empty()) fail_input("the runs hold no case");
  Fleet fleet{.places = times.places(), .settings = {}, .ties = 0, .own = {}};
  for (const FleetPlace& place : fleet.places)
    if (place.settings == 0) fail_without_setting(times, options);
  fleet.settings = common_settings(times, options);
  if (fleet.settings.empty()) fail_without_setting(times, options);
  std::ranges::stable_sort(fleet.settings, [](const FleetSetting& a, const FleetSetting& b) {
    const auto key = [](const FleetSetting& s) {
      return std::tuple(s.combined.value, simplicity(s.settings), s.memory_bytes);
    };
    return key(a) < key(b);
  });
  const Loss& pick = fleet.settings.front().combined;
  for (const FleetSetting& other : std::span(fleet.settings).subspan(1))
    fleet.ties += other.combined.low <= pick.high ? 1 : 0;
  for (std::size_t p = 0; p < fleet.places.size(); ++p) {
    const std::string id = setting_id(times.best(p).settings);
    OwnBest own{.settings = times.best(p).settings, .losses = {}};
    for (std::size_t other = 0; other < fleet.places.size(); ++other) own.losses.push_back(times.loss(id, other));
    fleet.own.push_back(std::move(own));
  }
  return fleet;
}

nlohmann::json fleet_json(const Fleet& fleet, std::span<const FleetRun> runs, const FleetOptions& options) {
  nlohmann::json places = nlohmann::json::array();
  for (std::size_t p = 0; p < fleet.places.size(); ++p) {
    const FleetPlace& place = fleet.places[p];
    nlohmann::json shipped = nlohmann::json::array();
    for (const std::optional<Loss>& loss : fleet.own[p].losses)
      shipped.push_back(loss ? loss_json(*loss) : nlohmann::json(nullptr));
    places.push_back({{"run", runs[place.run].name},
                      {"backend", place.backend},
                      {"device", place.device},
                      {"scene", place.scene},
                      {"scene_key", place.scene_key.hex},
                      {"weight", place.weight},
                      {"settings", place.settings},
                      {"best", setting_id(fleet.own[p].settings)},
                      {"best_in_each_place", shipped}});
  }
  nlohmann::json settings = nlohmann::json::array();
  for (const FleetSetting& one : fleet.settings) {
    nlohmann::json losses = nlohmann::json::array();
    for (const Loss& loss : one.losses) losses.push_back(loss_json(loss));
    settings.push_back(
        {{"setting", setting_id(one.settings)},
         {"key", setting_key(one.settings)},
         {"combined", {{"loss", one.combined.value}, {"interval", {one.combined.low, one.combined.high}}}},
         {"places", losses},
         {"memory_bytes", one.memory_bytes}});
  }
  return {{"regret", options.regret == Regret::minimax ? "minimax" : "mean"},
          {"budgets", budget_texts(options.budgets)},
          {"confidence", options.confidence},
          {"places", places},
          {"ties", fleet.ties},
          {"settings", settings}};
}

}  // namespace reliefbench
