#pragma once
#include <cstring>
#include <span>
#include <vector>

#include "kernels/judge/reference.h"
#include "tuner/measure/frame.h"
#include "tuner/measure/session.h"
#include "tuner/measure/stress.h"

namespace reliefbench {

// What run_stress() finds in the frames of one setting at one extreme.

/// A map, and the exact tracer of its heights as they are stored.
struct StoredMap {
  StoredMap(BakedMap baked, Wrap wrap) : map(std::move(baked)), tracer(map.heights, wrap) {}
  BakedMap map;
  ReferenceTracer tracer;
};

/// One frame of a setting: hits, and what its features of the scene made of them.
struct StressFrame {
  StressFrame(Backend& backend, std::span<const Draw> draws, const Settings& settings, const Mesh* on_mesh)
      : pixels(trace_frame(backend, draws)),
        values(backend.read_values(pixel_features(settings))),
        uniforms(draws.front().frame),
        mesh(on_mesh) {}

  std::vector<ScorePixel> pixels;
  FeatureValues values;
  FrameUniforms uniforms;
  const Mesh* mesh;  ///< null: it is on none

  [[nodiscard]] bool is_same(const StressFrame& other) const {
    return std::memcmp(pixels.data(), other.pixels.data(), pixels.size() * sizeof(ScorePixel)) == 0 &&
           values == other.values;
  }
};

/// Counts the pixels at fault by what one frame says by itself, and takes down its figures.
[[nodiscard]] JudgedFrame check_frame(const StressFrame& frame, const Settings& settings, const StoredMap& stored,
                                      Wrap wrap, StressResult& result);

/// Counts the pixels on which two backends do not agree, if they are too many.
void compare_frames(const StressFrame& a, const StressFrame& b, Wrap wrap, StressResult& result);

}  // namespace reliefbench
