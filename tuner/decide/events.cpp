#include "tuner/decide/events.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <tuple>
#include <utility>

#include "kernels/base/parallel.h"
#include "tuner/decide/series_groups.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

constexpr double kCommonShare = 2.0 / 3;  // of what a group's members moved that one step of all explains
constexpr double kAlike = 1.0 / 3;        // of the common step, from which on a member moved with the others
constexpr double kLeaveOut = 4.6;         // 2 log 10: a member is left out where its own nights say so, ten to one
constexpr std::size_t kLeastOnASide = 2;  // nights of a member from which its own step is known
constexpr std::size_t kEver = std::numeric_limits<std::size_t>::max();

/// A step or a ramp in time.
struct Movement {
  bool is_ramp = false;
  std::size_t from = 0;  // calendar: nights that tell of it, [from, to)
  std::size_t at = 0;    // first night of the new level
  std::size_t to = kEver;
  [[nodiscard]] double shape(std::size_t night) const {
    if (is_ramp) return static_cast<double>(night);
    return night >= at ? 1 : 0;
  }
};

/// A member's own move in a movement, by least squares.
struct OwnMove {
  double size = 0;
  double error = 0;  // standard error; 0 where its nights do not tell
  [[nodiscard]] double squared(double value) const { return value * value / (error * error); }
};

OwnMove own_move(const Movement& movement, const Track& track, double sigma) {
  const auto begin = std::ranges::lower_bound(track.calendar, movement.from) - track.calendar.begin();
  const auto end = std::ranges::lower_bound(track.calendar, movement.to) - track.calendar.begin();
  const auto at = std::ranges::lower_bound(track.calendar, movement.at) - track.calendar.begin();
  const auto least = static_cast<std::ptrdiff_t>(kLeastOnASide);
  if (!movement.is_ramp && (at - begin < least || end - at < least)) return {};
  double shape_mean = 0;
  double log_mean = 0;
  for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
    shape_mean += movement.shape(track.calendar[i]) / static_cast<double>(end - begin);
    log_mean += track.logs[i] / static_cast<double>(end - begin);
  }
  double products = 0;
  double squares = 0;
  for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
    const double shape = movement.shape(track.calendar[i]) - shape_mean;
    products += shape * (track.logs[i] - log_mean);
    squares += shape * shape;
  }
  if (squares <= 0) return {};
  return {.size = products / squares, .error = sigma / std::sqrt(squares)};
}

/// What is to become an event, but for its q.
struct Suspect {
  Movement movement;
  ChangeEvent event;
  double p = 1;
  std::vector<OwnMove> moves;  // parallel to the event's series
  double explained = 0;        // of its members' movement, in squared standard errors
};

/// A series or a group, and what was found in it.
struct Unit {
  std::string what;  // empty: a series by itself
  std::vector<std::size_t> members;
  Track track;
  SeriesChanges changes;
  std::vector<Suspect> suspects;
};

/// Series and groups of all machines, from which one event after the other is taken out.
class EventSearch {
 public:
  EventSearch(std::span<const CheckedSeries> series, const EventOptions& options);
  [[nodiscard]] Findings run();

 private:
  void check(const std::vector<bool>& is_touched);
  void check_series(std::size_t i);
  void check_group(Unit& group);
  void set_rates();
  [[nodiscard]] double q_of(double p) const;
  [[nodiscard]] std::optional<Suspect> best() const;
  [[nodiscard]] std::vector<Suspect> suspects_of(const Unit& unit) const;
  [[nodiscard]] Suspect step_of(const Unit& unit, std::size_t shift) const;
  [[nodiscard]] Suspect drift_of(const Unit& unit) const;
  [[nodiscard]] bool explain(Suspect& suspect) const;
  [[nodiscard]] Track pool_of(std::span<const std::size_t> members) const;
  void measure_members(Suspect& suspect) const;
  void take_out(const Suspect& suspect);
  [[nodiscard]] std::size_t most_events() const;

  EventOptions options_;
  std::vector<Unit> units_;  // the series first
  std::size_t series_ = 0;
  std::vector<Track> cleaned_;    // of series: without spikes
  std::vector<double> p_values_;  // sorted
  std::vector<double> rates_;     // parallel: the false discovery rate at which all up to this p are discoveries
  std::size_t taken_out_ = 0;     // events
  std::vector<SeriesChanges> of_series_;
};

EventSearch::EventSearch(std::span<const CheckedSeries> series, const EventOptions& options)
    : options_(options), series_(series.size()), cleaned_(series.size()) {
  for (const CheckedSeries& one : series) {
    assert(one.calendar.size() == one.log_values.size() && one.calendar.size() == one.standard_errors.size());
    const std::size_t i = units_.size();
    units_.push_back({.what = {},
                      .members = {i},
                      .track = {one.calendar, one.log_values, one.standard_errors},
                      .changes = {},
                      .suspects = {}});
  }
  for (SeriesGroup& group : series_groups(series))
    units_.push_back({.what = std::move(group.what),
                      .members = std::move(group.members),
                      .track = {},
                      .changes = {},
                      .suspects = {}});
  options_.change.told_p = options_.false_discovery_rate / static_cast<double>(std::max<std::size_t>(units_.size(), 1));
  check(std::vector<bool>(series_, true));
  for (std::size_t i = 0; i < series_; ++i) of_series_.push_back(units_[i].changes);
}

/// Series, and what shares a member with them.
void EventSearch::check(const std::vector<bool>& is_touched) {
  std::vector<std::size_t> touched;
  for (std::size_t i = 0; i < units_.size(); ++i)
    if (std::ranges::any_of(units_[i].members, [&](std::size_t member) { return is_touched[member]; }))
      touched.push_back(i);
  const auto groups = std::ranges::lower_bound(touched, series_);
  const auto each = [](std::span<const std::size_t> units, const std::function<void(std::size_t)>& work) {
    parallel_for(static_cast<int>(units.size()), 0, [&](int i) { work(units[static_cast<std::size_t>(i)]); });
  };
  each({touched.begin(), groups}, [&](std::size_t i) { check_series(i); });
  each({groups, touched.end()}, [&](std::size_t i) { check_group(units_[i]); });
  each(touched, [&](std::size_t i) { units_[i].suspects = suspects_of(units_[i]); });
  set_rates();
}

void EventSearch::check_series(std::size_t i) {
  Unit& unit = units_[i];
  unit.changes = find_changes(unit.track.logs, unit.track.errors, options_.change);
  Track& cleaned = cleaned_[i] = unit.track;
  const std::vector<std::size_t>& spikes = unit.changes.spikes;
  for (std::size_t last = spikes.size(); last-- > 0;) {
    const auto offset = static_cast<std::ptrdiff_t>(spikes[last]);
    cleaned.calendar.erase(cleaned.calendar.begin() + offset);
    cleaned.logs.erase(cleaned.logs.begin() + offset);
    cleaned.errors.erase(cleaned.errors.begin() + offset);
  }
}

/// Series weigh by their noise, but none more than one of median noise: what they share is not less for that.
Track EventSearch::pool_of(std::span<const std::size_t> members) const {
  std::vector<double> sigmas;
  for (const std::size_t i : members) sigmas.push_back(units_[i].changes.sigma);
  const double usual = median(sigmas);
  std::vector<WeightedTrack> tracks;
  for (const std::size_t i : members) {
    const double sigma = std::max(units_[i].changes.sigma, usual);
    tracks.push_back({.track = &cleaned_[i], .weight = sigma > 0 ? usual * usual / (sigma * sigma) : 1});
  }
  return pooled(tracks);
}

void EventSearch::check_group(Unit& group) {
  group.track = pool_of(group.members);
  group.changes = find_changes(group.track.logs, group.track.errors, options_.change);
}

/// A series or group is one hypothesis, with the least p in it; so is every event that was taken out of them.
void EventSearch::set_rates() {
  p_values_.assign(taken_out_, 0);
  for (const Unit& unit : units_) {
    double p = unit.changes.drift ? unit.changes.drift->p : 1;
    for (const Shift& shift : unit.changes.shifts) p = std::min(p, shift.p);
    p_values_.push_back(p);
  }
  std::ranges::sort(p_values_);
  const auto hypotheses = static_cast<double>(p_values_.size());
  rates_.resize(p_values_.size());
  double least = 1;
  for (std::size_t i = p_values_.size(); i-- > 0;)
    rates_[i] = least = std::min(least, hypotheses * p_values_[i] / static_cast<double>(i + 1));
}

/// The least false discovery rate at which this p is a discovery. What an event explains is taken out before the next
/// is judged: its many series and groups are one discovery, and lend no credit to a series by itself.
/// source: Benjamini & Hochberg, "Controlling the false discovery rate", 1995
double EventSearch::q_of(double p) const {
  const auto hypotheses = static_cast<double>(p_values_.size());
  const auto first = static_cast<std::size_t>(std::ranges::upper_bound(p_values_, p) - p_values_.begin());
  const double own = hypotheses * p / std::max<double>(1, static_cast<double>(first));
  return std::min(own, first < rates_.size() ? rates_[first] : 1);
}

Suspect EventSearch::step_of(const Unit& unit, std::size_t shift) const {
  const Shift& found = unit.changes.shifts[shift];
  const Level& before = unit.changes.levels[shift];
  const Level& after = unit.changes.levels[shift + 1];
  const std::vector<std::size_t>& calendar = unit.track.calendar;
  return {.movement = {.is_ramp = false,
                       .from = calendar[before.first],
                       .at = calendar[found.at],
                       .to = after.end < calendar.size() ? calendar[after.end] : kEver},
          .event = {.what = unit.what,
                    .series = unit.members,
                    .good = calendar[found.earliest - 1],
                    .bad = calendar[found.latest],
                    .is_drift = false,
                    .log_ratio = found.log_ratio,
                    .low = found.low,
                    .high = found.high,
                    .q = 1,
                    .is_sure = after.end - after.first >= options_.change.least_nights + options_.confirming_nights},
          .p = found.p,
          .moves = {},
          .explained = 0};
}

Suspect EventSearch::drift_of(const Unit& unit) const {
  const Drift& found = *unit.changes.drift;
  const std::vector<std::size_t>& calendar = unit.track.calendar;
  const auto nights = static_cast<double>(calendar.size() - 1);
  return {.movement = {.is_ramp = true, .from = calendar.front(), .at = calendar.front(), .to = kEver},
          .event = {.what = unit.what,
                    .series = unit.members,
                    .good = calendar.front(),
                    .bad = calendar.back(),
                    .is_drift = true,
                    .log_ratio = found.log_ratio_per_night * nights,
                    .low = found.low * nights,
                    .high = found.high * nights,
                    .q = 1,
                    .is_sure = true},
          .p = found.p,
          .moves = {},
          .explained = 0};
}

/// Whether one size for all members explains most of what they moved. If so, its series become those that moved.
bool EventSearch::explain(Suspect& suspect) const {
  std::vector<OwnMove> moves;
  std::vector<std::size_t> members;
  double weights = 0;
  double size = 0;
  for (const std::size_t i : suspect.event.series) {
    const OwnMove move = own_move(suspect.movement, cleaned_[i], units_[i].changes.sigma);
    if (move.error <= 0) continue;
    members.push_back(i);
    moves.push_back(move);
    weights += move.squared(1);
    size += move.squared(1) * move.size;
  }
  if (members.empty()) return false;
  size /= weights;
  double all = -static_cast<double>(members.size());  // what noise alone would move
  for (const OwnMove& move : moves) {
    all += move.squared(move.size);
    suspect.explained += move.squared(move.size) - move.squared(move.size - size);
  }
  if (members.size() > 1 && suspect.explained < kCommonShare * all) return false;
  suspect.event.series.clear();
  for (std::size_t i = 0; i < members.size(); ++i) {
    const bool is_alike = moves[i].size / size > kAlike;
    if (!is_alike && moves[i].squared(moves[i].size - size) > moves[i].squared(moves[i].size) + kLeaveOut) continue;
    suspect.event.series.push_back(members[i]);
    suspect.moves.push_back(moves[i]);
  }
  return !suspect.event.series.empty();
}

std::vector<Suspect> EventSearch::suspects_of(const Unit& unit) const {
  std::vector<Suspect> suspects;
  for (std::size_t i = 0; i < unit.changes.shifts.size(); ++i)
    if (unit.changes.shifts[i].matters) suspects.push_back(step_of(unit, i));
  if (unit.changes.drift) {
    const Suspect drift = drift_of(unit);
    const double least = std::log1p(options_.change.least_effect);
    if (drift.event.low > least || drift.event.high < -least) suspects.push_back(drift);
  }
  std::erase_if(suspects, [&](Suspect& one) { return !explain(one); });
  return suspects;
}

/// Of the discoveries, that which explains most; of equals, the one of fewer traits.
std::optional<Suspect> EventSearch::best() const {
  const Unit* its_unit = nullptr;
  const Suspect* best = nullptr;
  const auto offer = [&](const Unit& unit) {
    for (const Suspect& suspect : unit.suspects) {
      if (best != nullptr && suspect.explained <= best->explained) continue;
      if (q_of(suspect.p) > options_.false_discovery_rate) continue;
      its_unit = &unit;
      best = &suspect;
    }
  };
  for (std::size_t i = series_; i < units_.size(); ++i) offer(units_[i]);
  for (std::size_t i = 0; i < series_; ++i) offer(units_[i]);
  if (best == nullptr) return std::nullopt;
  Suspect suspect = *best;
  suspect.event.q = q_of(suspect.p);
  if (suspect.event.series.size() < its_unit->members.size()) measure_members(suspect);
  return suspect;
}

/// Where members were left out, how far the others moved.
void EventSearch::measure_members(Suspect& suspect) const {
  if (suspect.movement.is_ramp) return;
  const Track track = pool_of(suspect.event.series);
  const SeriesChanges changes = find_changes(track.logs, track.errors, options_.change);
  for (const Shift& shift : changes.shifts) {
    if (track.calendar[shift.earliest - 1] >= suspect.event.bad) continue;
    if (track.calendar[shift.latest] <= suspect.event.good) continue;
    suspect.event.good = track.calendar[shift.earliest - 1];
    suspect.event.bad = track.calendar[shift.latest];
    suspect.event.log_ratio = shift.log_ratio;
    suspect.event.low = shift.low;
    suspect.event.high = shift.high;
    return;
  }
}

/// Every member by what it moved itself, so that nothing of the event is found again. What shares a member is looked at
/// anew.
void EventSearch::take_out(const Suspect& suspect) {
  std::vector<bool> is_touched(series_);
  for (std::size_t i = 0; i < suspect.event.series.size(); ++i) {
    Track& track = units_[suspect.event.series[i]].track;
    for (std::size_t night = 0; night < track.logs.size(); ++night)
      track.logs[night] -= suspect.moves[i].size * suspect.movement.shape(track.calendar[night]);
    is_touched[suspect.event.series[i]] = true;
  }
  ++taken_out_;
  check(is_touched);
}

/// Whether an event is what is left of an earlier one: at the same nights, in series of which most were in that.
bool is_rest_of(const ChangeEvent& event, const ChangeEvent& earlier) {
  if (event.is_drift != earlier.is_drift || event.good >= earlier.bad || event.bad <= earlier.good) return false;
  const auto shared = std::ranges::count_if(
      event.series, [&](std::size_t i) { return std::ranges::find(earlier.series, i) != earlier.series.end(); });
  return 2 * static_cast<std::size_t>(shared) > event.series.size();
}

/// More than there are causes, so that the search ends in any case.
std::size_t EventSearch::most_events() const {
  std::size_t most = units_.size();
  for (const Unit& unit : units_) most += unit.changes.shifts.size() + (unit.changes.drift ? 1 : 0);
  return most;
}

Findings EventSearch::run() {
  Findings findings{.series = of_series_, .events = {}};
  for (std::size_t most = most_events(); most > 0; --most) {
    const std::optional<Suspect> suspect = best();
    if (!suspect) break;
    const ChangeEvent& event = suspect->event;
    if (std::ranges::none_of(findings.events, [&](const ChangeEvent& earlier) { return is_rest_of(event, earlier); }))
      findings.events.push_back(event);
    take_out(*suspect);
  }
  const auto rank = [](const ChangeEvent& event) {
    return std::tuple(event.log_ratio < 0, !event.is_sure, -std::abs(event.log_ratio));
  };
  std::ranges::stable_sort(findings.events, {}, rank);
  return findings;
}

}  // namespace

Findings find_events(std::span<const CheckedSeries> series, const EventOptions& options) {
  return EventSearch(series, options).run();
}

}  // namespace reliefbench
