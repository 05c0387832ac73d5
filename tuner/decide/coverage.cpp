#include "tuner/decide/coverage.h"

#include <algorithm>
#include <map>
#include <string_view>
#include <vector>

namespace reliefbench {
namespace {

/// The runs of each machine, counted.
class MachineCalendar {
 public:
  explicit MachineCalendar(const HistoryView& view) {
    for (const RunRow& run : view.runs) places_[run.id] = {.place = runs_[run.machine]++, .unix_s = run.unix_s};
  }
  [[nodiscard]] std::size_t runs(std::string_view machine) const { return runs_.at(machine); }
  [[nodiscard]] std::size_t place(std::int64_t run) const { return places_.at(run).place; }
  [[nodiscard]] std::int64_t unix_s(std::int64_t run) const { return places_.at(run).unix_s; }

 private:
  struct Place {
    std::size_t place = 0;
    std::int64_t unix_s = 0;
  };
  std::map<std::string_view, std::size_t> runs_;
  std::map<std::int64_t, Place> places_;
};

bool is_gone(std::span<const std::int64_t> valid, std::size_t runs, const MachineCalendar& calendar,
             std::size_t least_nights) {
  std::size_t longest = 0;
  for (std::size_t i = 1; i < valid.size(); ++i)
    longest = std::max(longest, calendar.place(valid[i]) - calendar.place(valid[i - 1]));
  return runs - 1 - calendar.place(valid.back()) >= std::max(longest, least_nights);
}

}  // namespace

Coverage coverage_of(const HistoryView& view, std::span<const EpochChanges> epochs, const EventOptions& options) {
  const MachineCalendar calendar(view);
  std::map<std::size_t, std::size_t> in_epoch;  // nights of each series' last epoch
  for (const EpochChanges& epoch : epochs) in_epoch[epoch.series] = epoch.nights.size();
  // A step shows by its own nights and as many before them.
  const std::size_t enough = 2 * options.change.least_nights;
  Coverage coverage;
  std::size_t most = 0;
  std::size_t most_runs = 0;
  for (const auto& [s, nights] : in_epoch) {
    std::vector<std::int64_t> valid;
    for (const RepetitionRow& night : view.nights[s])
      if (night.is_valid) valid.push_back(night.run);
    const std::size_t runs = calendar.runs(view.series[s].machine);
    if (is_gone(valid, runs, calendar, options.change.least_nights)) {
      const std::int64_t last = calendar.unix_s(valid.back());
      coverage.gone_unix_s = coverage.gone == 0 ? last : std::min(coverage.gone_unix_s, last);
      ++coverage.gone;
      continue;
    }
    ++coverage.looked_at;
    most = std::max(most, nights);
    most_runs = std::max(most_runs, runs);
    if (nights < enough) ++coverage.waiting;
  }
  if (most_runs < enough) coverage.waiting = 0;
  coverage.nights_to_wait = enough - std::min(most, enough);
  return coverage;
}

}  // namespace reliefbench
