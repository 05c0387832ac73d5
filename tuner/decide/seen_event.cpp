#include "tuner/decide/seen_event.h"

#include <fmt/format.h>

#include <algorithm>

#include "tuner/decide/changes.h"
#include "tuner/history/series_name.h"

namespace reliefbench {

EventRow event_between(const std::string& machine, std::int64_t good_run, std::int64_t bad_run) {
  EventRow row;
  row.machine = machine;
  row.good_run = good_run;
  row.bad_run = bad_run;
  row.algorithm = kChangesVersion;
  return row;
}

std::string name_among(const HistoryView& view, std::size_t series) {
  const SeriesRow& row = view.series[series];
  bool has_metrics = false;
  bool has_devices = false;
  for (const SeriesRow& other : view.series) {
    if (other.case_id != row.case_id || other.machine != row.machine) continue;
    has_metrics |= other.metric != row.metric;
    has_devices |= other.device != row.device;
  }
  return series_name(row) + (has_metrics ? ", " + row.metric : "") + (has_devices ? " on " + row.device : "");
}

std::string common_name(const HistoryView& view, std::span<const std::size_t> series) {
  if (series.size() == 1) return name_among(view, series.front());
  const SeriesRow& first = view.series[series.front()];
  const auto all = [&](auto member) {
    return std::ranges::all_of(series, [&](std::size_t s) { return view.series[s].*member == first.*member; });
  };
  std::string name = fmt::format("{} cases", series.size());
  if (all(&SeriesRow::backend)) name += " on " + first.backend;
  if (all(&SeriesRow::technique)) name += ", technique=" + first.technique;
  return name;
}

}  // namespace reliefbench
