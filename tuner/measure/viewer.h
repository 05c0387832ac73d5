#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "kernels/judge/score.h"
#include "tuner/measure/map_library.h"
#include "tuner/measure/session.h"

namespace reliefbench {

/// A frame with what can be said of it.
struct ViewedFrame {
  std::vector<std::uint8_t> rgba8;  ///< the shaded frame, rows from the top
  double wall_ns = 0;               ///< of its drawing; one frame, so a hint
  JudgedFrame judged;
};

/// Draws single frames of one heightmap, just as a sweep draws and judges them.
class Viewer {
 public:
  /// scene: its view does not matter; heightmaps: what has been read already. What takes longer than a case may in a
  /// sweep (MeasureSpec::timeout_s) ends as that does.
  /// throws: Error(bad_input): unreadable heightmap; Error(environment): no such device
  Viewer(const BackendRow& row, int device, SceneSpec scene, Heightmaps heightmaps = {}, OpenDevice open = open_device);
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  /// Bakes, uploads and compiles what the next frames are drawn with.
  /// throws: Error(bad_input): settings that make no sense together; Error(environment): the device cannot draw them
  void choose(const Settings& settings);
  /// choose() comes first.
  [[nodiscard]] ViewedFrame draw(const View& view);

 private:
  SceneSpec scene_;
  Cache cache_ = Cache::open();
  WallSplit split_;
  Session session_;
  MapLibrary library_;
  const Heightfield& heights_;
  ReferenceTracer tracer_;
  UploadedScene uploaded_;
  std::optional<Settings> settings_;
  Frame frame_;
};

}  // namespace reliefbench
