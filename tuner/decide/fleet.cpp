#include "tuner/decide/fleet.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <tuple>

#include "kernels/base/clock.h"
#include "kernels/base/error.h"
#include "kernels/base/suggest.h"
#include "tuner/decide/best_loss.h"
#include "tuner/decide/choose.h"
#include "tuner/decide/place_times.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/budgets.h"
#include "tuner/results/coarse_filter.h"

namespace reliefbench {
namespace {

struct RegretRow {
  Regret regret;
  std::string_view id;
};
constexpr std::array kRegrets = {RegretRow{Regret::minimax, "minimax"}, RegretRow{Regret::mean, "mean"}};

/// A place's losses by setting, and which setting is its own best.
struct PlaceLosses {
  std::map<std::string, Loss> losses;
  std::string best;
};

std::optional<double> error_in(const TableRow& row, const std::string& metric) {
  return row.errors[find_metric(metric).place];
}

bool is_within(const TableRow& row, const FleetOptions& options) {
  const auto value_of = [&](const Budget& budget) { return error_in(row, budget.metric); };
  if (row.status != Status::ok || !miss_of(options.budgets, value_of).text.empty()) return false;
  if (!options.max_time_ms) return true;
  return row.frame_time && row.frame_time->ci_high <= *options.max_time_ms * kNsPerMs &&
         error_in(row, options.error_metric).has_value();
}

/// Whether a value that was measured is beyond its bound.
bool is_beyond(const TableRow& row, const FleetOptions& options) {
  if (row.status != Status::ok) return false;
  const auto misses = [&](const Budget& budget) {
    const std::optional<double> value = error_in(row, budget.metric);
    return value && !within(value, budget);
  };
  if (std::ranges::any_of(options.budgets, misses)) return true;
  return options.max_time_ms && row.frame_time && row.frame_time->ci_high > *options.max_time_ms * kNsPerMs;
}

bool is_measured(const MeasuredPlace& place) {
  return std::ranges::any_of(place.cases, [](const std::vector<const TableRow*>& run) {
    return std::ranges::any_of(run, [](const TableRow* row) { return row->status == Status::ok; });
  });
}

/// Settings that are beyond a bound in some run of a place.
std::set<std::string> settings_beyond(const MeasuredPlace& place, const FleetOptions& options) {
  std::set<std::string> beyond;
  for (const std::vector<const TableRow*>& run : place.cases)
    for (const TableRow* row : run)
      if (is_beyond(*row, options)) beyond.insert(setting_id(row->settings));
  return beyond;
}

Loss loss_of(const SettingTime& time, const LossInterval& interval) {
  return {.value = interval.value,
          .low = interval.low,
          .high = interval.high,
          .time_ns = std::exp(time.log_time),
          .row = time.rows.front()};
}

/// Losses of time.
std::vector<PlaceLosses> time_losses(std::span<const PlaceTimes> places, double confidence) {
  std::vector<std::vector<Estimate>> groups;
  for (const PlaceTimes& place : places) {
    groups.emplace_back();
    for (const auto& [id, time] : place.settings)
      groups.back().push_back({.value = time.log_time, .variance = time.variance, .df = time.df});
  }
  const auto intervals = losses_to_best(groups, confidence);
  std::vector<PlaceLosses> result(places.size());
  for (std::size_t p = 0; p < places.size(); ++p) {
    std::size_t i = 0;
    for (const auto& [id, time] : places[p].settings) {
      const LossInterval& log = intervals[p][i++];
      const LossInterval share{
          .value = std::expm1(log.value), .low = std::expm1(log.low), .high = std::expm1(log.high)};
      result[p].losses.emplace(id, loss_of(time, share));
      if (log.value == 0 && result[p].best.empty()) result[p].best = id;
    }
  }
  return result;
}

/// Losses of error, which is exact. Of equal errors the least time is best.
PlaceLosses error_losses(const PlaceTimes& place, std::size_t metric) {
  PlaceLosses result;
  std::pair<double, double> least;
  for (const auto& [id, time] : place.settings) {
    const std::pair own(*time.rows.front()->errors[metric], time.log_time);
    if (result.best.empty() || own < least) {
      least = own;
      result.best = id;
    }
  }
  for (const auto& [id, time] : place.settings) {
    const double excess = *time.rows.front()->errors[metric] - least.first;
    result.losses.emplace(id, loss_of(time, {.value = excess, .low = excess, .high = excess}));
  }
  return result;
}

/// The places of the runs with what is within the bounds there.
class FleetTimes {
 public:
  FleetTimes(std::span<const FleetRun> runs, const FleetOptions& options) {
    std::vector<PlaceTimes> times;
    const std::vector<MeasuredPlace> measured = places_of(runs);
    repeated_ = repeated_texts(measured, runs);
    for (const MeasuredPlace& place : measured) {
      const std::set<std::string> beyond = settings_beyond(place, options);
      const auto counts = [&](const TableRow& row) {
        return is_within(row, options) && !beyond.contains(setting_id(row.settings));
      };
      times.push_back(place_times(place, runs, counts));
      double weight = 0;
      for (const std::size_t run : place.runs) weight += runs[run].weight / static_cast<double>(place.runs.size());
      places_.push_back({.device = place.device,
                         .scene = place.scene,
                         .scene_key = place.scene_key,
                         .runs = place.runs,
                         .weight = weight,
                         .settings = times.back().settings.size(),
                         .is_measured = is_measured(place),
                         .between_runs = times.back().between_runs});
    }
    if (!options.max_time_ms)
      losses_ = time_losses(times, options.confidence);
    else
      for (const PlaceTimes& place : times)
        losses_.push_back(error_losses(place, find_metric(options.error_metric).place));
  }

  [[nodiscard]] const std::vector<FleetPlace>& places() const { return places_; }
  [[nodiscard]] const std::vector<std::string>& repeated() const { return repeated_; }
  [[nodiscard]] std::optional<Loss> loss(const std::string& setting, std::size_t place) const {
    const auto found = losses_[place].losses.find(setting);
    return found == losses_[place].losses.end() ? std::nullopt : std::optional(found->second);
  }
  [[nodiscard]] const PlaceLosses& in(std::size_t place) const { return losses_[place]; }

 private:
  std::vector<FleetPlace> places_;
  std::vector<std::string> repeated_;
  std::vector<PlaceLosses> losses_;
};

/// What leaves nothing to choose from.
[[noreturn]] void fail_without_setting(const FleetTimes& times, const FleetOptions& options) {
  const auto& places = times.places();
  const auto fewest = std::ranges::min_element(places, {}, &FleetPlace::settings);
  const std::string within = bounds_text(options);
  if (const auto none = std::ranges::find(places, false, &FleetPlace::is_measured); none != places.end())
    throw Error(Exit::nothing_measured, fmt::format("nothing was measured on {}", place_text(*none, places)));
  if (fewest->settings == 0)
    throw Error(Exit::answer_is_no, fmt::format("nothing meets {} on {}", within, place_text(*fewest, places)));
  throw Error(Exit::answer_is_no,
              fmt::format("no setting was measured and meets {} in all {} places; the fewest, {}, do "
                          "on {}",
                          within, places.size(), fewest->settings, place_text(*fewest, places)));
}

std::vector<FleetSetting> common_settings(const FleetTimes& times, const FleetOptions& options) {
  std::vector<FleetSetting> settings;
  for (const auto& [id, loss] : times.in(0).losses) {
    FleetSetting one{
        .settings = loss.row->settings, .losses = {}, .combined = {}, .memory_bytes = loss.row->memory_bytes};
    for (std::size_t p = 0; p < times.places().size(); ++p)
      if (const std::optional<Loss> own = times.loss(id, p)) one.losses.push_back(*own);
    if (one.losses.size() < times.places().size()) continue;
    one.combined = combined_loss(one.losses, times.places(), options.regret);
    settings.push_back(std::move(one));
  }
  return settings;
}

/// Of settings that lose as much: time decides where error was to be least, then what is simplest and smallest.
auto fleet_rank(const FleetSetting& one) {
  double log_time = 0;
  for (const Loss& loss : one.losses) log_time += std::log(loss.time_ns);
  return std::tuple(one.combined.value, log_time, simplicity(one.settings), one.memory_bytes);
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

std::string_view regret_id(Regret regret) { return std::ranges::find(kRegrets, regret, &RegretRow::regret)->id; }

Regret find_regret(std::string_view id) { return find_row(kRegrets, "regret", id).regret; }

std::vector<std::string> regret_ids() {
  std::vector<std::string> ids;
  ids.reserve(kRegrets.size());
  for (const RegretRow& row : kRegrets) ids.emplace_back(row.id);
  return ids;
}

std::string place_text(const FleetPlace& place, std::span<const FleetPlace> all) {
  std::vector<MeasuredDevice> devices;
  devices.reserve(all.size());
  for (const FleetPlace& other : all) devices.push_back(other.device);
  const auto is_namesake = [&](const FleetPlace& other) {
    return other.scene == place.scene && other.scene_key != place.scene_key;
  };
  const bool is_told = std::ranges::any_of(all, is_namesake) && !place.scene_key.hex.empty();
  const std::string which = is_told ? fmt::format(" ({})", place.scene_key.short_text()) : "";
  return fmt::format("{} in {}{}", device_text(place.device, devices), place.scene, which);
}

std::string_view coarse_mark(std::span<const Loss> losses) {
  for (const Loss& loss : losses)
    if (const std::string_view mark = coarse_mark(*loss.row); !mark.empty()) return mark;
  return "";
}

std::set<std::string> coarse_notes(const Fleet& fleet) {
  std::vector<const TableRow*> rows;
  rows.reserve(2 * fleet.places.size());
  for (std::size_t p = 0; p < fleet.places.size(); ++p) {
    rows.push_back(fleet.settings.front().losses[p].row);
    rows.push_back(fleet.own[p].losses[p]->row);
  }
  return coarse_notes(rows);
}

std::string bounds_text(const FleetOptions& options) {
  std::vector<std::string> texts;
  texts.reserve(options.budgets.size() + 1);
  for (const Budget& budget : options.budgets)
    texts.push_back(std::isinf(budget.limit) ? fmt::format("any value of {}", budget.metric) : budget.text());
  if (options.max_time_ms) texts.push_back(fmt::format("at most {:.4g} ms", *options.max_time_ms));
  return texts.empty() ? "no bound" : fmt::format("{}", fmt::join(texts, " and "));
}

Fleet choose_for_fleet(std::span<const FleetRun> runs, const FleetOptions& options) {
  if (!find_metric(options.error_metric).lower_is_better)
    fail_input("'{}' is no error: higher is better", options.error_metric);
  const FleetTimes times(runs, options);
  if (times.places().empty()) throw Error(Exit::nothing_measured, "the runs hold no case");
  Fleet fleet{.places = times.places(), .settings = {}, .ties = 0, .own = {}, .repeated = times.repeated()};
  for (const FleetPlace& place : fleet.places)
    if (place.settings == 0) fail_without_setting(times, options);
  fleet.settings = common_settings(times, options);
  if (fleet.settings.empty()) fail_without_setting(times, options);
  std::ranges::stable_sort(fleet.settings, {}, fleet_rank);
  const Loss& pick = fleet.settings.front().combined;
  for (const FleetSetting& other : std::span(fleet.settings).subspan(1))
    fleet.ties += other.combined.low <= pick.high ? 1 : 0;
  for (std::size_t p = 0; p < fleet.places.size(); ++p) {
    const std::string& id = times.in(p).best;
    OwnBest own{.settings = times.in(p).losses.at(id).row->settings, .losses = {}};
    for (std::size_t other = 0; other < fleet.places.size(); ++other) own.losses.push_back(times.loss(id, other));
    fleet.own.push_back(std::move(own));
  }
  return fleet;
}

}  // namespace reliefbench
