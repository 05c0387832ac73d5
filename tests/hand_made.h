#pragma once
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "kernels/maps/map_kind.h"
#include "kernels/trace/technique.h"
#include "tests/made_score.h"
#include "tuner/results/record.h"

namespace reliefbench {

/// What a test says of a case; the rest is filled in.
struct HandMade {
  std::string case_id;
  double time_ns = 1000;  ///< median; the interval is 1 % to either side
  double e_xy_p99 = 0;
  double missed_rate = 0;
  std::string technique = "relief";
  std::vector<std::pair<std::string, std::string>> params{};  ///< that are not default
  std::string scene = "rocks/top";
  std::string backend = "null";
  std::int64_t memory_bytes = 0;
};

inline Record make_record(const HandMade& made) {
  Record record;
  record.case_id = made.case_id;
  record.technique = made.technique;
  Settings settings(find_technique(made.technique));
  for (const auto& [id, text] : made.params) settings.set(id, text);
  for (const Param& param : settings.technique().params)
    if (settings.is_active(param)) record.params.emplace_back(param.id, param.text(settings.get(param.id)));
  record.map = map_of(settings).id;
  record.scene = made.scene;
  record.backend = made.backend;
  record.device = "device";
  record.memory_bytes = made.memory_bytes;
  record.frame_time = FrameTime{.summary = {.median = made.time_ns,
                                            .mad = 0,
                                            .ci_low = made.time_ns * 0.99,
                                            .ci_high = made.time_ns * 1.01,
                                            .n = 7},
                                .raw_median = made.time_ns,
                                .timer = "fenced_wall"};
  FrameScore score = made_score();
  score.pixels = 1;
  score["e_xy.p99"] = made.e_xy_p99;
  score["missed_rate"] = made.missed_rate;
  record.error = score;
  return record;
}

}  // namespace reliefbench
