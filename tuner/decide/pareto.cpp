#include "tuner/decide/pareto.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <tuple>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

bool intervals_overlap(const Summary& a, const Summary& b) { return a.ci_low <= b.ci_high && b.ci_low <= a.ci_high; }

Front front_of(const RecordGroup& group, std::string_view error_metric, std::span<const Budget> constraints) {
  std::vector<const Record*> eligible;
  std::vector<double> time;
  std::vector<double> error;
  for (const Record* record : group.records) {
    const std::optional<double> value = metric_value(*record, error_metric);
    const auto met = [&](const Budget& budget) { return meets(*record, budget); };
    if (!value || !record->frame_time || !std::all_of(constraints.begin(), constraints.end(), met)) continue;
    eligible.push_back(record);
    time.push_back(record->frame_time->summary.median);
    error.push_back(*value);
  }

  Front front{.backend = group.backend,
              .device = group.device,
              .scene = group.scene,
              .scene_key = group.scene_key,
              .error_metric = std::string(error_metric),
              .constraints = budget_texts(constraints),
              .points = {}};

  const std::vector<std::size_t> on_front = pareto_front(time, error);
  std::vector<bool> is_on_front(eligible.size(), false);
  for (const std::size_t i : on_front) is_on_front[i] = true;
  for (const std::size_t i : on_front) {
    FrontPoint point{.record = eligible[i], .time_ns = time[i], .error = error[i], .equivalents = {}};
    for (std::size_t j = 0; j < eligible.size(); ++j) {
      const bool same_time = intervals_overlap(eligible[j]->frame_time->summary, eligible[i]->frame_time->summary);
      if (!is_on_front[j] && error[j] <= error[i] && same_time) point.equivalents.push_back(eligible[j]);
    }
    front.points.push_back(std::move(point));
  }
  return front;
}

}  // namespace

std::vector<RecordGroup> group_records(std::span<const Record> records) {
  std::map<std::tuple<std::string, std::string, std::string, SceneKey>, std::vector<const Record*>> by_key;
  for (const Record& record : records)
    by_key[{record.backend, record.device, record.scene, record.scene_key}].push_back(&record);
  std::vector<RecordGroup> groups;
  for (auto& [key, members] : by_key) {
    const auto& [backend, device, scene, scene_key] = key;
    groups.push_back(
        {.backend = backend, .device = device, .scene = scene, .scene_key = scene_key, .records = std::move(members)});
  }
  return groups;
}

std::vector<std::size_t> pareto_front(std::span<const double> time, std::span<const double> error) {
  if (time.size() != error.size())
    fail_input("a front needs as many errors as times, not {} and {}", error.size(), time.size());
  for (std::size_t i = 0; i < time.size(); ++i) {
    // A NaN compares false with everything, so it would be neither kept nor dropped for a reason.
    if (std::isnan(time[i]) || std::isnan(error[i])) fail_input("point {} of a front is not a number", i);
  }
  std::vector<std::size_t> order(time.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::tie(time[a], error[a], a) < std::tie(time[b], error[b], b);
  });
  // Every later point is no faster, so it is on the front only if it is strictly more accurate than all before.
  std::vector<std::size_t> front;
  for (const std::size_t i : order) {
    if (front.empty() || error[i] < error[front.back()]) front.push_back(i);
  }
  return front;
}

std::vector<Front> fronts(std::span<const Record> records, std::string_view error_metric,
                          std::span<const Budget> constraints) {
  if (!find_metric(error_metric).lower_is_better) {
    fail_input("the error of a front must be a metric where lower is better, not '{}'", error_metric);
  }
  std::vector<Front> result;
  for (const RecordGroup& group : group_records(records)) result.push_back(front_of(group, error_metric, constraints));
  return result;
}

nlohmann::json fronts_json(std::span<const Front> fronts) {
  nlohmann::json list = nlohmann::json::array();
  for (const Front& front : fronts) {
    nlohmann::json points = nlohmann::json::array();
    for (const FrontPoint& point : front.points) {
      nlohmann::json equivalents = nlohmann::json::array();
      for (const Record* record : point.equivalents) equivalents.push_back(record->case_id);
      const Summary& summary = point.record->frame_time->summary;
      points.push_back({{"case", point.record->case_id},
                        {"time_ns", point.time_ns},
                        {"ci", {summary.ci_low, summary.ci_high}},
                        {"coverage", interval_coverage(summary.n)},
                        {"error", point.error},
                        {"equivalents", std::move(equivalents)}});
    }
    list.push_back({{"backend", front.backend},
                    {"device", front.device},
                    {"scene", front.scene},
                    {"scene_key", front.scene_key.hex},
                    {"error_metric", front.error_metric},
                    {"constraints", front.constraints},
                    {"points", std::move(points)}});
  }
  return {{"schema", kSchemaVersion}, {"fronts", std::move(list)}};
}

}  // namespace reliefbench
