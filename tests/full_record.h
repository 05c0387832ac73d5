#pragma once
#include "tuner/results/record.h"

namespace reliefbench {

/// A score in which every number has a value of its own.
inline FrameScore full_score() {
  FrameScore score{.pixels = 65536};
  double value = 0;
  for (std::optional<double>& number : score.values) number = value += 1.0 / 64;
  return score;
}

/// An ok record in which every field has a value of its own.
inline Record full_record() {
  return {.case_id = "relief@rocks/top?linear_steps=16&refinement=binary&binary_steps=5&format=r8&backend=opengl",
          .technique = "relief",
          .params = {{"linear_steps", "16"}, {"refinement", "binary"}, {"binary_steps", "5"}, {"format", "r8"}},
          .map = "height",
          .scene = "rocks/top",
          .scene_key = {std::string(64, 'd')},
          .backend = "opengl",
          .device = "llvmpipe",
          .status = Status::ok,
          .reason = "a note",
          .frame_time = FrameTime{.summary = {.median = 1e6, .mad = 1e4, .ci_low = 9e5, .ci_high = 1.1e6, .n = 7},
                                  .raw_median = 1.05e6,
                                  .timer = "gl_timestamp"},
          .error = full_score(),
          .memory_bytes = 65536,
          .bake_time_ns = 7.5,
          .device_bake_ns = 0.75,
          .first_draw_ns = 2.5e6,
          .timing_key = "aa",
          .bake_key = "bb",
          .reference_key = "cc"};
}

}  // namespace reliefbench
