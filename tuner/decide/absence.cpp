#include "tuner/decide/absence.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

bool is_looked_for(const EventRow& event, double least_effect) {
  return event.low > least_effect || std::log1p(event.high) < -std::log1p(least_effect);
}

}  // namespace

Absence::Absence(const HistoryView& view, const EventOptions& options)
    : view_(view), options_(options), calendar_(view.runs) {
  for (std::size_t i = 0; i < view.series.size(); ++i) series_[view.series[i].id] = i;
}

bool Absence::is_gone(const EventRow& event) const {
  if (!std::ranges::all_of(event.series, [&](std::int64_t id) { return series_.contains(id); })) return false;
  if (event.kind == event_kind::lost) return are_ok_again(event);
  if (!calendar_.has(event.good_run) || !calendar_.has(event.bad_run)) return false;
  if (event.kind == event_kind::errors) return true;
  if (!is_looked_for(event, options_.change.least_effect)) return false;
  return event.kind == event_kind::drift || is_taken_back(event);
}

bool Absence::are_ok_again(const EventRow& event) const {
  return std::ranges::all_of(event.series, [&](std::int64_t id) {
    return std::ranges::any_of(view_.nights[series_.at(id)], [&](const RepetitionRow& night) {
      return night.status == "ok" && calendar_.of(night.run) > calendar_.of(event.bad_run);
    });
  });
}

bool Absence::is_taken_back(const EventRow& event) const {
  double left = 0;
  for (const std::int64_t id : event.series) {
    std::vector<double> before;
    std::vector<double> after;
    for (const RepetitionRow& night : view_.nights[series_.at(id)]) {
      if (!night.is_valid) continue;
      if (calendar_.of(night.run) <= calendar_.of(event.good_run)) before.push_back(std::log(night.value));
      if (calendar_.of(night.run) >= calendar_.of(event.bad_run)) after.push_back(std::log(night.value));
    }
    if (std::min(before.size(), after.size()) < options_.change.least_nights) return false;
    left += (median(after) - median(before)) / static_cast<double>(event.series.size());
  }
  return view_.is_whole || left / std::log1p(event.effect) < 0.5;
}

}  // namespace reliefbench
