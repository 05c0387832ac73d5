#pragma once
#include "tuner/results/record.h"

namespace reliefbench {

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
          .error = FrameScore{.pixels = 65536,
                              .e_xy = {.mean = 0.1, .p50 = 0.05, .p95 = 0.3, .p99 = 0.5, .max = 9},
                              .e_z = {.mean = 0.01, .p50 = 0.005, .p95 = 0.03, .p99 = 0.06, .max = 0.9},
                              .missed_rate = 0.001,
                              .inside_rate = 0.002,
                              .unconverged_rate = 0.003,
                              .mean_taps = 12.5,
                              .max_taps = 30,
                              .psnr = 38.5,
                              .flip = 0.125,
                              .ssim = 0.75,
                              .flicker = 0.01},
          .memory_bytes = 65536,
          .bake_time_ns = 7.5,
          .first_draw_ns = 2.5e6,
          .timing_key = "aa",
          .bake_key = "bb",
          .reference_key = "cc"};
}

}  // namespace reliefbench
