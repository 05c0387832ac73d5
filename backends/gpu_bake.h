#pragma once
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "backends/backend.h"
#include "backends/shader_compiler.h"
#include "kernels/maps/map_kind.h"

namespace reliefbench {

/// Map kinds with a compute-shader baker.
[[nodiscard]] std::span<const MapKind> gpu_bakers();
[[nodiscard]] bool has_gpu_baker(MapKind kind);

/// What bakers' shaders go by of a device.
struct BakeDevice {
  /// Without, `conservative`, `relaxed` and the quick kinds are still baked: ratios then are at most kMostUlpsUnder
  /// under the CPU's, and never above. Of `certified` these are the limits: where one texel has less, the next may have
  /// more.
  bool has_doubles = true;
  /// With, the rays of `relaxed_po07` are walked by invocations that share nothing; without, by workgroups.
  bool is_software = true;
};
inline constexpr int kMostUlpsUnder = 70;

/// The compute shaders that a map kind's baker runs, by name.
/// throws: Error(bad_input): a kind that gpu_bakers() has not, or one that needs doubles which the device has not
[[nodiscard]] std::map<std::string, Spirv> compile_baker(MapKind kind, Dialect dialect, BakeDevice device);

/// A map that a GPU baked.
struct GpuBake {
  std::vector<float> values;  ///< what MapRow::bake gives
  std::vector<ComputeTime>
      times;                ///< on the device's clock: upload, refine, pyramid, search, correction, pack, read_back
  double transport_ns = 0;  ///< ComputeResult::transport_ns
};

/// The compute-shader baker of a map kind, compiled once. All of the work is the device's: the pyramid, the search, the
/// roots and their rounding, the 3x3 minimum.
class GpuBaker {
 public:
  /// dialect: of the backend's row
  /// throws: Error(bad_input): a kind that gpu_bakers() has not; Error(environment): a device that has no doubles for a
  /// kind that needs them, or no compute
  GpuBaker(Backend& backend, Dialect dialect, MapKind kind);
  /// device: instead of what the backend's is
  GpuBaker(Backend& backend, Dialect dialect, MapKind kind, BakeDevice device);

  /// `threads` counts for nothing. With doubles the map has the bits of the CPU's baker on every device whose double
  /// additions and products round to nearest: divisions and roots are put right in the shader.
  /// throws: Error(bad_input) as the CPU's baker does; Error(environment): the map is too large for the device's
  /// buffers
  [[nodiscard]] GpuBake bake(const BakeRequest& request) const;

 private:
  /// What the device cut short is kCutShort.
  [[nodiscard]] GpuBake bake_once(const BakeRequest& request, int patience) const;

  Backend& backend_;
  MapKind kind_;
  BakeDevice device_;
  std::map<std::string, std::unique_ptr<Pipeline>> pipelines_;
};

}  // namespace reliefbench
