#pragma once
#include <memory>
#include <vector>

#include "kernels/map_texture.h"
#include "kernels/reference.h"
#include "tuner/map_library.h"
#include "tuner/session.h"

namespace reliefbench {

/// A setting's map of one heightmap, in memory, and the exact tracer of its heights as they are stored.
struct BakedScene {
  BakedMap map;
  MapTextures textures;
  ReferenceTracer tracer;
};
[[nodiscard]] BakedScene bake_scene(const Settings& settings, const Heightfield& heights, const Scene& scene);

/// Frames of one setting on one device, for commands that draw cases one by one.
class TraceDevice {
 public:
  /// throws: Error(environment): no such device
  TraceDevice(const BackendRow& row, int index, WallSplit& split, bool is_timed = false);

  [[nodiscard]] Session& session() { return session_; }
  [[nodiscard]] const DeviceInfo& info() const { return session_.device(); }

  /// A draw with the textures that it needs.
  struct Frame {
    std::unique_ptr<Texture> relief;
    std::unique_ptr<Texture> extra;
    Draw draw;
  };
  [[nodiscard]] Frame frame(const Settings& settings, const BakedScene& baked, const Scene& scene, Target target);
  /// The score frame.
  [[nodiscard]] std::vector<ScorePixel> trace(const Frame& frame);

 private:
  Session session_;
  std::unique_ptr<Texture> blank_;
};

}  // namespace reliefbench
