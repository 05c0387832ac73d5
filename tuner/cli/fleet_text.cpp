#include "tuner/cli/fleet_text.h"

#include <fmt/format.h>

#include "tuner/cli/format.h"
#include "tuner/cli/loss_text.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/coarse_filter.h"

namespace reliefbench {
namespace {

/// "3.1 % [2.2, 4.0]", or an excess of error, which is exact.
std::string loss_text(const Loss& loss, const FleetOptions& options) {
  if (options.max_time_ms) return fmt::format("+{}", format_number(loss.value));
  return time_loss_text(loss);
}

void print_places(const Fleet& fleet, const FleetOptions& options, const Names& names) {
  const FleetSetting& pick = fleet.settings.front();
  std::vector<std::vector<std::string>> rows = {
      {"", "place", "the pick's time", options.max_time_ms ? options.error_metric : "slower by"}};
  for (std::size_t p = 0; p < fleet.places.size(); ++p)
    rows.push_back({column_letter(p),
                    fmt::format("{}{}", place_text(fleet.places[p], fleet.places), coarse_mark(*pick.losses[p].row)),
                    format_time_ns(pick.losses[p].time_ns), loss_text(pick.losses[p], options)});
  put("\n{}\n", columns(rows, "  "));
  for (std::size_t p = 0; p < fleet.places.size(); ++p) {
    const OwnBest& own = fleet.own[p];
    put("  {}'s own best: {}\n", column_letter(p),
        own.settings == pick.settings
            ? "the pick"
            : fmt::format("{}{}", names.setting(setting_id(own.settings)), coarse_mark(*own.losses[p]->row)));
  }
}

void print_transfer(const Fleet& fleet, const FleetOptions& options) {
  std::vector<std::vector<std::string>> rows = {{"best of"}};
  for (std::size_t p = 0; p < fleet.places.size(); ++p) rows.front().push_back("on " + column_letter(p));
  for (std::size_t p = 0; p < fleet.places.size(); ++p) {
    rows.push_back({column_letter(p)});
    for (const std::optional<Loss>& loss : fleet.own[p].losses)
      rows.back().push_back(loss ? loss_text(*loss, options) : "not within, or not measured");
  }
  put("\nWhat it costs to ship the best of one place in another{}:\n{}",
      options.max_time_ms ? ", in " + options.error_metric : "", columns(rows, "  "));
}

/// What the intervals of time know of runs that differ without a cause.
void print_between_runs(const Fleet& fleet, const Paint& paint) {
  std::vector<std::string> unknown;
  for (std::size_t p = 0; p < fleet.places.size(); ++p) {
    const FleetPlace& place = fleet.places[p];
    if (!place.between_runs)
      unknown.push_back(column_letter(p));
    else
      put("{}\n", paint.dim(fmt::format("{}: {} runs; a case shifts by {:.2g} % from one to the next without a cause, "
                                        "which is in the intervals.",
                                        column_letter(p), place.runs.size(), 100 * *place.between_runs)));
  }
  if (!unknown.empty())
    put("{}\n", paint.dim(fmt::format("Of {} there is one run: what shifts a case from run to run is not known there, "
                                      "nor in the intervals. Give two runs of a device.",
                                      fmt::join(unknown, ", "))));
}

}  // namespace

void print_fleet(const Fleet& fleet, const FleetOptions& options, const Names& names) {
  const Paint paint = paint_for_stdout();
  const FleetSetting& pick = fleet.settings.front();
  const bool is_minimax = options.regret == Regret::minimax;
  const std::size_t places = fleet.places.size();
  put("One setting for {} place{} with {}, of {} that are within that in {}:\n", places, places == 1 ? "" : "s",
      bounds_text(options), fleet.settings.size(), places == 1 ? "it" : "all");
  put("  {}\n", paint.good(fmt::format("{}{}", names.setting(setting_id(pick.settings)), coarse_mark(pick.losses))));
  if (options.max_time_ms)
    put("  {} beyond each place's own least by {} {} {}\n", options.error_metric, is_minimax ? "at most" : "on average",
        format_number(pick.combined.value), find_metric(options.error_metric).unit);
  else
    put("  slower than each place's own best by {} {}\n", is_minimax ? "at most" : "on average",
        loss_text(pick.combined, options));
  if (fleet.ties > 0)
    put("  {}\n", paint.dim(fmt::format("{} others {}", fleet.ties,
                                        options.max_time_ms ? "lose no more error; they are slower"
                                                            : "cannot be told from it: their intervals overlap")));
  print_places(fleet, options, names);
  if (fleet.places.size() > 1) print_transfer(fleet, options);
  put("\n{}\n", paint.dim("A setting for each place by itself would save what the first table's pick loses there."));
  for (const std::string& note : coarse_notes(fleet)) put("{}\n", paint.dim(note));
  if (options.max_time_ms) return;
  put("{}\n", paint.dim(fmt::format("All intervals together: {:.0f} %.", 100 * options.confidence)));
  print_between_runs(fleet, paint);
}

}  // namespace reliefbench
