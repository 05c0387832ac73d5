#include <algorithm>
#include <array>
#include <unordered_map>

#include "kernels/base/error.h"
#include "tuner/history/connection.h"

namespace reliefbench {
namespace {

constexpr std::array<std::string_view, 6> kEventStateIds{"suspect",     "confirmed", "cleared",
                                                         "environment", "recovered", "accepted"};

/// What a change-point row holds, beside its series.
bool is_known_so(const EventRow& stored, const EventRow& now) {
  const auto known = [](const EventRow& e) {
    return std::tie(e.good_run, e.bad_run, e.effect, e.low, e.high, e.q, e.algorithm, e.series);
  };
  return known(stored) == known(now);
}

/// As the database gives it back.
EventRow storable_event(EventRow event) {
  event.key = storable(event.key);
  event.machine = storable(event.machine);
  std::ranges::sort(event.series);
  event.series.erase(std::unique(event.series.begin(), event.series.end()), event.series.end());
  for (EventStateRow& state : event.states) {
    state.by = storable(state.by);
    state.text = storable(state.text);
  }
  return event;
}

/// The events of some machines, read once, to which others are added.
class EventTable {
 public:
  EventTable(soci::session& sql, std::span<const EventRow> added)
      : next_event_(next_id(sql, "event")),
        next_point_(next_id(sql, "change_point")),
        next_state_(next_id(sql, "event_state")),
        events_(sql, "event (id, key, machine, kind, what)"),
        points_(sql, "change_point (id, event, good_run, bad_run, effect, low, high, q, algorithm)"),
        members_(sql, "change_point_series (change_point, series)"),
        states_(sql, "event_state (id, event, unix_s, state, author, said)") {
    for (const EventRow& event : added) {
      const std::string machine = storable(event.machine);
      if (machines_.contains(machine)) continue;
      machines_.emplace(machine, machine_id(sql, machine));
      for (EventRow& stored : read_events(sql, machine)) {
        const std::string key = stored.key;
        known_.emplace(key, std::move(stored));
      }
    }
  }

  /// returns: its id
  std::int64_t add(const EventRow& given) {
    EventRow event = storable_event(given);
    const auto [place, is_new] = known_.try_emplace(event.key);
    EventRow& stored = place->second;
    event.id = is_new ? next_event_++ : stored.id;
    if (is_new) events_(event.id, event.key, machines_.at(event.machine), storable(event.kind), storable(event.what));
    if (is_new || !is_known_so(stored, event)) add_point(event);
    std::vector<EventStateRow> states = std::move(stored.states);
    for (const EventStateRow& state : event.states) {
      if (std::ranges::find(states, state) != states.end()) continue;
      states_(next_state_++, event.id, state.unix_s, std::string(event_state_id(state.state)), state.by, state.text);
      states.push_back(state);
    }
    event.states = std::move(states);
    stored = std::move(event);
    return stored.id;
  }
  void write() {
    events_.write();
    points_.write();  // refers to those
    members_.write();
    states_.write();
  }

 private:
  using Id = std::int64_t;
  using Text = std::string;

  void add_point(const EventRow& event) {
    const Id id = next_point_++;
    points_(id, event.id, event.good_run, event.bad_run, event.effect, event.low, event.high, event.q, event.algorithm);
    for (const Id series : event.series) members_(id, series);
  }

  Id next_event_;
  Id next_point_;
  Id next_state_;
  Insert<Id, Text, Id, Text, Text> events_;
  Insert<Id, Id, Id, Id, double, double, double, double, int> points_;
  Insert<Id, Id> members_;
  Insert<Id, Id, Id, Text, Text, Text> states_;
  std::unordered_map<Text, Id> machines_{};
  std::unordered_map<Text, EventRow> known_{};  // by key
};

/// Events with what is known of them last; without their series and states.
std::vector<EventRow> read_change_points(soci::session& sql, const std::string& machine) {
  std::vector<EventRow> events;
  using Id = std::int64_t;
  each_row<Id, std::string, std::string, std::string, std::string, Id, Id, double, double, double, double, int>(
      sql,
      "SELECT e.id, e.key, m.name, e.kind, e.what, c.good_run, c.bad_run, c.effect, c.low, c.high, c.q, c.algorithm"
      " FROM event e JOIN machine m ON m.id = e.machine JOIN change_point c ON c.event = e.id"
      " WHERE c.id = (SELECT MAX(id) FROM change_point WHERE event = e.id)"
      " AND (:any = '' OR m.name = :machine) ORDER BY e.id",
      [&](Id id, const std::string& key, const std::string& name, const std::string& kind, const std::string& what,
          Id good_run, Id bad_run, double effect, double low, double high, double q, int algorithm) {
        events.push_back({.id = id,
                          .key = key,
                          .machine = name,
                          .kind = kind,
                          .what = what,
                          .good_run = good_run,
                          .bad_run = bad_run,
                          .effect = effect,
                          .low = low,
                          .high = high,
                          .q = q,
                          .algorithm = algorithm,
                          .series = {},
                          .states = {}});
      },
      machine, machine);
  return events;
}

}  // namespace

std::string_view event_state_id(EventState state) { return kEventStateIds.at(static_cast<std::size_t>(state)); }

EventState parse_event_state(std::string_view id) {
  const auto found = std::ranges::find(kEventStateIds, id);
  if (found == kEventStateIds.end()) fail_input("unknown state '{}' of an event", id);
  return static_cast<EventState>(found - kEventStateIds.begin());
}

std::vector<EventRow> read_events(soci::session& sql, const std::string& machine) {
  std::vector<EventRow> events = read_change_points(sql, machine);
  std::unordered_map<std::int64_t, EventRow*> by_id;
  for (EventRow& event : events) by_id.emplace(event.id, &event);
  const auto find = [&](std::int64_t id) {
    const auto found = by_id.find(id);
    return found == by_id.end() ? nullptr : found->second;
  };
  each_row<std::int64_t, std::int64_t>(
      sql,
      "SELECT c.event, s.series FROM change_point c JOIN change_point_series s ON s.change_point = c.id"
      " WHERE c.id = (SELECT MAX(id) FROM change_point WHERE event = c.event) ORDER BY s.series",
      [&](std::int64_t id, std::int64_t series) {
        if (EventRow* event = find(id)) event->series.push_back(series);
      });
  each_row<std::int64_t, std::int64_t, std::string, std::string, std::string>(
      sql, "SELECT event, unix_s, state, author, said FROM event_state ORDER BY id",
      [&](std::int64_t id, std::int64_t unix_s, const std::string& state, const std::string& by,
          const std::string& text) {
        if (EventRow* event = find(id))
          event->states.push_back({.unix_s = unix_s, .state = parse_event_state(state), .by = by, .text = text});
      });
  return events;
}

std::vector<std::int64_t> write_events(soci::session& sql, std::span<const EventRow> events) {
  EventTable table(sql, events);
  std::vector<std::int64_t> ids;
  ids.reserve(events.size());
  for (const EventRow& event : events) ids.push_back(table.add(event));
  table.write();
  return ids;
}

}  // namespace reliefbench
