#pragma once
#include <memory>
#include <string>
#include <vector>

#include "kernels/judge/reference.h"
#include "kernels/maps/map_texture.h"
#include "tuner/measure/map_library.h"
#include "tuner/measure/session.h"

namespace reliefbench {

/// A setting's map of one heightmap, in memory, and the exact tracer of its heights as they are stored.
struct BakedScene {
  std::shared_ptr<const BakedMap> map;
  std::shared_ptr<const ReferenceTracer> tracer;
  MapTextures textures;
};

/// Bakes maps of one heightmap. Settings that follow one another and share a bake (bake_text) share its map and tracer.
class SceneBaker {
 public:
  explicit SceneBaker(Heightfield heights) : heights_(std::move(heights)) {}

  [[nodiscard]] const Heightfield& heights() const { return heights_; }
  [[nodiscard]] BakedScene bake(const Settings& settings, const SceneSpec& scene);

 private:
  Heightfield heights_;
  std::string text_;  // of the last bake
  std::shared_ptr<const BakedMap> map_;
  std::shared_ptr<const ReferenceTracer> tracer_;
};

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
  [[nodiscard]] Frame frame(const Settings& settings, const BakedScene& baked, const Scene& scene,
                            const Target& target);
  /// The score frame.
  [[nodiscard]] std::vector<ScorePixel> trace(const Frame& frame);

 private:
  Session session_;
  std::unique_ptr<Texture> blank_;
};

}  // namespace reliefbench
