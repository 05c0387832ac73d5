#include <cmath>
#include <map>

#include "tuner/decide/track.h"

namespace reliefbench {
namespace {

using nlohmann::json;

/// Whether two environments differ in nothing but a step of the processor's clock, which Google Benchmark measures and
/// which is stored in hundreds of MHz: near the middle of two it goes up once and down once.
bool is_a_step_of_the_clock(json a, json b) {
  constexpr const char* kClock = "mhz_per_cpu";
  constexpr double kStep = 100;
  for (const json* environment : {&a, &b})
    if (!environment->contains(kClock) || !environment->at(kClock).is_number()) return false;
  if (std::abs(a[kClock].get<double>() - b[kClock].get<double>()) > kStep) return false;
  a.erase(kClock);
  b.erase(kClock);
  return a == b;
}

/// The environments of a view's runs.
class Environments {
 public:
  explicit Environments(const HistoryView& view) {
    for (const EnvironmentRow& row : view.environments) contents_.emplace(row.id, row.content);
  }
  [[nodiscard]] bool are_same(std::int64_t a, std::int64_t b) const {
    if (a == b) return true;
    const auto first = contents_.find(a);
    const auto second = contents_.find(b);
    return first != contents_.end() && second != contents_.end() &&
           is_a_step_of_the_clock(first->second, second->second);
  }

 private:
  std::map<std::int64_t, json> contents_;
};

}  // namespace

std::vector<std::size_t> epochs_of(const HistoryView& view) {
  struct Last {
    std::int64_t environment = 0;  ///< of its first run
    std::size_t epoch = 0;
  };
  const Environments environments(view);
  std::map<std::string, Last> machines;
  std::vector<std::size_t> epochs;
  epochs.reserve(view.runs.size());
  for (const RunRow& run : view.runs) {
    Last& last = machines.try_emplace(run.machine, Last{.environment = run.environment}).first->second;
    if (!environments.are_same(last.environment, run.environment))
      last = {.environment = run.environment, .epoch = last.epoch + 1};
    epochs.push_back(last.epoch);
  }
  return epochs;
}

}  // namespace reliefbench
