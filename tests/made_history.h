#pragma once
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "tuner/history/rows.h"

namespace reliefbench {

/// A history of one machine in memory: so many nights of three techniques with eight cases each, with 1 % of noise and
/// a control case.
struct MadeHistory {
  static constexpr std::size_t kCases = 8;

  explicit MadeHistory(std::size_t nights, unsigned seed = 1) {
    view.environments = {{.id = 1, .hash = "aaaaaaaa", .content = {{"host", {{"os", "Linux 6.1"}}}}}};
    view.scores = {{.id = 1, .values = {{"e_xy.p99", 0.25}, {"missed_rate", 0.0}}},
                   {.id = 2, .values = {{"e_xy.p99", 0.5}, {"missed_rate", 0.0}}}};
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0, 0.01);
    for (std::size_t night = 0; night < nights; ++night) add_run(night, noise(random));
    for (const char* technique : {"relief", "cone", "relaxed_cone"}) {
      for (std::size_t i = 0; i < kCases; ++i) {
        add_series(technique, i);
        for (std::size_t night = 0; night < nights; ++night)
          view.nights.back().push_back({.run = run_id(night),
                                        .median = 1e6,
                                        .mad = 1e3,
                                        .n = 10,
                                        .value = (1.0 + static_cast<double>(i)) * std::exp(noise(random)),
                                        .standard_error = 0.005,
                                        .status = "ok",
                                        .code = "code",
                                        .score = 1,
                                        .samples = {}});
      }
    }
  }

  [[nodiscard]] static std::int64_t run_id(std::size_t night) { return static_cast<std::int64_t>(100 + night); }

  /// Changes the nights from `first` on, of a technique's series ("" = all).
  void change(const std::string& technique, std::size_t first, const std::function<void(RepetitionRow&)>& what) {
    for (std::size_t s = 0; s < view.series.size(); ++s)
      if (technique.empty() || view.series[s].technique == technique)
        for (std::size_t night = first; night < view.nights[s].size(); ++night) what(view.nights[s][night]);
  }
  void slow_down(const std::string& technique, std::size_t first, double factor) {
    change(technique, first, [&](RepetitionRow& night) { night.value *= factor; });
  }
  /// Every night shifts all cases by one factor of its own.
  void shake(double deviation, unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> effect(0, deviation);
    for (std::size_t night = 0; night < view.runs.size(); ++night) {
      const double factor = std::exp(effect(random));
      for (auto& nights : view.nights) nights[night].value *= factor;
    }
  }
  void set_code(const std::string& technique, std::size_t first, const std::string& code) {
    change(technique, first, [&](RepetitionRow& night) { night.code = code; });
  }
  void slow_control(std::size_t first, double factor) {
    for (std::size_t night = first; night < view.runs.size(); ++night)
      view.runs[night].calibrations.front().control_ns *= factor;
  }

  HistoryView view;

 private:
  void add_run(std::size_t night, double noise) {
    RunRow run;
    run.id = run_id(night);
    run.content = std::to_string(night);
    run.kind = "reliefbench";
    run.machine = "ci-7";
    run.environment = 1;
    run.unix_s = 1'760'000'000 + static_cast<std::int64_t>(night) * 86400;
    run.build.commit = "commit" + std::to_string(night);
    run.source = "out/" + std::to_string(night);
    run.health = {{"devices", {{{"backend", "vulkan"}, {"name", "fake"}, {"driver", "1"}}}}};
    run.calibrations = {{.device = "vulkan fake", .control_ns = 1e6 * std::exp(noise), .mad = 2e3, .n = 20}};
    view.runs.push_back(std::move(run));
  }

  void add_series(const std::string& technique, std::size_t i) {
    SeriesRow row;
    row.id = static_cast<std::int64_t>(view.series.size() + 1);
    row.machine = "ci-7";
    row.case_id = technique + "@rocks/oblique?case=" + std::to_string(i) + "&backend=vulkan";
    row.setting = row.case_id;
    row.scene = "rocks/oblique";
    row.scene_key = "00";
    row.technique = technique;
    row.map = technique == "relief" ? "height" : "conservative";
    row.format = i % 2 == 0 ? "rg8" : "rg16f";
    row.backend = "vulkan";
    row.device = "vulkan fake";
    row.metric = "frame_time";
    row.unit = "ns";
    view.series.push_back(std::move(row));
    view.nights.emplace_back();
  }
};

/// A night on which the case was lost.
inline void crash(RepetitionRow& night) {
  night.status = "crashed";
  night.is_valid = false;
  night.score = 0;
}

}  // namespace reliefbench
