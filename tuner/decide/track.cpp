#include "tuner/decide/track.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>

#include "kernels/base/sha256.h"
#include "tuner/decide/absence.h"
#include "tuner/decide/coverage.h"
#include "tuner/decide/run_calendar.h"
#include "tuner/decide/track_certain.h"
#include "tuner/decide/track_steps.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

/// The share of the smaller one's series that two events have in common.
double overlap(const EventRow& a, const EventRow& b) {
  if (a.series.empty() || b.series.empty()) return a.what == b.what ? 1 : 0;
  const auto both = std::ranges::count_if(
      a.series, [&](std::int64_t id) { return std::ranges::find(b.series, id) != b.series.end(); });
  return static_cast<double>(both) / static_cast<double>(std::min(a.series.size(), b.series.size()));
}

/// Whether the nights of two events overlap. With more nights a step may be seen a little earlier or later; the nights
/// of what has no size are certain.
bool is_same_time(const EventRow& a, const EventRow& b, const RunCalendar& calendar) {
  const std::ptrdiff_t slack = has_size(a) ? 2 : 0;
  return calendar.of(a.good_run) < calendar.of(b.bad_run) + slack &&
         calendar.of(b.good_run) < calendar.of(a.bad_run) + slack;
}

bool is_near(const EventRow& known, const EventRow& found, const RunCalendar& calendar) {
  return known.machine == found.machine && known.kind == found.kind && calendar.has(known.bad_run) &&
         is_same_time(known, found, calendar) && overlap(known, found) >= 0.5;
}

/// Whether a step of some series of a known event lies in its nights: few nights show a group's step in pieces.
bool is_part_of(const EventRow& known, const EventRow& found, const RunCalendar& calendar) {
  return has_size(found) && known.machine == found.machine && known.kind == found.kind && calendar.has(known.bad_run) &&
         calendar.of(known.good_run) < calendar.of(found.bad_run) &&
         calendar.of(found.good_run) < calendar.of(known.bad_run) && !found.series.empty() &&
         std::ranges::all_of(
             found.series, [&](std::int64_t id) { return std::ranges::find(known.series, id) != known.series.end(); });
}

/// Of what tells it from all others of one look: names may be equal, and of cases that are lost the ways as well.
std::string key_of(const SeenEvent& seen) {
  const EventRow& event = seen.row;
  std::vector<std::int64_t> series = event.series;
  std::ranges::sort(series);
  return sha256(fmt::format("{}|{}|{}|{}|{}|{}|{}", event.machine, event.kind, event.what, event.good_run,
                            event.bad_run, fmt::join(series, ","), has_size(event) ? "" : seen.reason));
}

std::string size_when_accepted(const EventRow& event) { return fmt::format("{:.1f} %", 100 * std::abs(event.effect)); }

EventState last_state(const EventRow& event) { return event.states.back().state; }

bool is_regression(const EventRow& event) { return event.kind != event_kind::faster; }

/// What a check makes of one event: the states that are known of it, and perhaps a new one.
class Judgement {
 public:
  Judgement(EventRow event, std::int64_t now) : event_(std::move(event)), now_(now) {}

  void become(EventState state, std::string text) {
    if (!event_.states.empty() && last_state(event_) == state) return;
    event_.states.push_back({.unix_s = now_, .state = state, .by = "check", .text = std::move(text)});
    is_news_ = true;
  }
  /// What is seen tonight of what may be known.
  void see(const SeenEvent& seen) {
    if (event_.states.empty()) return become(seen.state, seen.reason);
    switch (last_state(event_)) {
      case EventState::accepted:
      case EventState::environment:
      case EventState::recovered:
        return;
      case EventState::confirmed:
        if (seen.state != EventState::suspect) become(seen.state, seen.reason);
        return;
      case EventState::suspect:
        return become(seen.state, seen.reason);
      case EventState::cleared:
        return see_again(seen);
    }
  }
  /// What is gone.
  void miss() {
    if (!is_open(event_)) return;
    if (event_.kind == event_kind::lost) return become(EventState::recovered, "the cases are ok again");
    if (event_.kind == event_kind::errors)
      return become(EventState::cleared, "the errors are what they were before it");
    become(EventState::cleared, "further nights took it back");
  }
  /// What is seen as part of another one.
  void join() {
    if (is_open(event_)) become(EventState::cleared, "is part of what is seen now");
  }

  EventRow& event() { return event_; }
  [[nodiscard]] const EventRow& event() const { return event_; }
  [[nodiscard]] bool is_news() const { return is_news_; }

 private:
  void see_again(const SeenEvent& seen) {
    const bool by_rerun = event_.states.back().by == "confirm";
    if (!by_rerun) return become(seen.state, seen.reason);
    if (seen.state != EventState::suspect)
      become(EventState::environment, "it stays, and a re-run of both builds did not show it");
  }

  EventRow event_;
  std::int64_t now_;
  bool is_news_ = false;
};

/// Which of the seen events each known one is: first those of its very key, then those that are near. Of two that may
/// be the same one, what a person accepted comes first and what was cleared last, so that neither takes the other's
/// place.
std::vector<std::optional<std::size_t>> partners_of(std::span<const EventRow> known, std::span<const SeenEvent> seen,
                                                    const RunCalendar& calendar) {
  const auto rank = [&](std::size_t k) {
    const EventState state = last_state(known[k]);
    return state == EventState::accepted ? 0 : (state == EventState::cleared ? 2 : 1);
  };
  std::vector<std::size_t> order(known.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, rank);
  std::vector<std::optional<std::size_t>> partners(known.size());
  std::vector<bool> is_taken(seen.size(), false);
  const auto pair_up = [&](const auto& are_same) {
    for (const std::size_t k : order)
      for (std::size_t i = 0; i < seen.size() && !partners[k]; ++i) {
        if (is_taken[i] || !are_same(known[k], seen[i].row)) continue;
        partners[k] = i;
        is_taken[i] = true;
      }
  };
  pair_up([](const EventRow& a, const EventRow& b) { return a.key == b.key; });
  pair_up([&](const EventRow& a, const EventRow& b) { return is_near(a, b, calendar); });
  return partners;
}

/// Whether a drift went on since a person accepted it, by what would matter by itself.
bool went_on(const EventRow& accepted, const EventRow& seen, double least_effect) {
  const double low = std::min(std::abs(std::log1p(seen.low)), std::abs(std::log1p(seen.high)));
  return low - std::abs(std::log1p(accepted.effect)) > std::log1p(least_effect);
}

/// What is known of an event, with what tonight shows of its nights, series and size.
EventRow updated(EventRow known, EventRow seen) {
  seen.id = known.id;
  seen.key = std::move(known.key);
  seen.states = std::move(known.states);
  return seen;
}

/// A regression that a later improvement of the same cases took back, by half of it at least.
bool is_undone(const EventRow& event, std::span<const SeenEvent> seen, const RunCalendar& calendar) {
  if (event.kind != event_kind::slower) return false;
  const double size = std::log1p(event.effect);
  return std::ranges::any_of(seen, [&](const SeenEvent& other) {
    const EventRow& later = other.row;
    return later.kind == event_kind::faster && later.machine == event.machine && overlap(event, later) >= 0.5 &&
           calendar.of(later.good_run) >= calendar.of(event.bad_run) && -std::log1p(later.effect) / size >= 0.5;
  });
}

/// Open regressions first, the sure and the large ones before the others.
int rank_of(const EventRow& event) {
  constexpr std::array kOrder = {EventState::confirmed, EventState::suspect,  EventState::environment,
                                 EventState::recovered, EventState::accepted, EventState::cleared};
  const auto place = std::ranges::find(kOrder, last_state(event)) - kOrder.begin();
  return static_cast<int>(place) + (is_open(event) || place >= 2 ? 0 : 2);
}

void sort_worst_first(std::vector<Judgement>& judged) {
  std::ranges::stable_sort(judged, [](const Judgement& a, const Judgement& b) {
    const auto key = [](const EventRow& e) { return std::pair(rank_of(e), -std::abs(std::log1p(e.effect))); };
    return key(a.event()) < key(b.event());
  });
}

}  // namespace

bool is_open(const EventRow& event) {
  const EventState state = last_state(event);
  return is_regression(event) && (state == EventState::suspect || state == EventState::confirmed);
}

TrackCheck check_history(const HistoryView& view, const EventOptions& options, std::int64_t now_unix_s) {
  const RunCalendar calendar(view.runs);
  StepCheck steps = check_steps(view, options);
  std::vector<SeenEvent> seen = std::move(steps.events);
  std::ranges::move(changed_errors(view), std::back_inserter(seen));
  std::ranges::move(lost_cases(view), std::back_inserter(seen));
  for (SeenEvent& one : seen) one.row.key = key_of(one);

  const Absence absence(view, options);
  const std::vector<std::optional<std::size_t>> partners = partners_of(view.events, seen, calendar);
  std::vector<Judgement> judged;
  std::vector<bool> is_known(seen.size(), false);
  for (std::size_t k = 0; k < partners.size(); ++k) {
    const EventRow& known = view.events[k];
    if (partners[k]) {
      const SeenEvent& same = seen[*partners[k]];
      is_known[*partners[k]] = true;
      if (known.kind == event_kind::drift && last_state(known) == EventState::accepted) {
        const bool is_open_again = went_on(known, same.row, options.change.least_effect);
        judged.emplace_back(is_open_again ? updated(known, same.row) : known, now_unix_s);
        if (is_open_again)
          judged.back().become(same.state, "it went on since it was accepted at " + size_when_accepted(known));
        continue;
      }
      judged.emplace_back(updated(known, same.row), now_unix_s);
      judged.back().see(same);
      continue;
    }
    judged.emplace_back(known, now_unix_s);
    if (std::ranges::any_of(seen, [&](const SeenEvent& other) { return is_near(known, other.row, calendar); }))
      judged.back().join();
    else if (absence.is_gone(known))
      judged.back().miss();
  }
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto is_whole = [&](const EventRow& known) { return is_part_of(known, seen[i].row, calendar); };
    if (is_known[i] || std::ranges::any_of(view.events, is_whole)) continue;
    if (std::ranges::any_of(judged, [&](const Judgement& one) { return is_whole(one.event()); }))
      continue;  // of another epoch, which goes on in turns
    judged.emplace_back(seen[i].row, now_unix_s);
    judged.back().see(seen[i]);
  }
  for (Judgement& one : judged)
    if (is_open(one.event()) && is_undone(one.event(), seen, calendar))
      one.become(EventState::recovered, "a later change brought the old level back");
  sort_worst_first(judged);

  TrackCheck check{.events = {},
                   .is_news = {},
                   .epochs = {},
                   .case_shift = steps.case_shift,
                   .coverage = coverage_of(view, steps.epochs, options)};
  check.epochs = std::move(steps.epochs);
  for (Judgement& one : judged) {
    check.is_news.push_back(one.is_news());
    check.events.push_back(std::move(one.event()));
  }
  return check;
}

Exit exit_of(const TrackCheck& check, const HistoryView& view, bool news_only) {
  if (view.runs.empty()) return Exit::nothing_measured;
  for (std::size_t i = 0; i < check.events.size(); ++i)
    if (is_open(check.events[i]) && (!news_only || check.is_news[i])) return Exit::answer_is_no;
  return Exit::done;
}

std::vector<EventRow> news_of(const TrackCheck& check) {
  std::vector<EventRow> news;
  for (std::size_t i = 0; i < check.events.size(); ++i)
    if (check.is_news[i]) news.push_back(check.events[i]);
  return news;
}

}  // namespace reliefbench
