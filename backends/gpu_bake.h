#pragma once
#include <memory>
#include <span>
#include <vector>

#include "backends/backend.h"
#include "backends/shader_compiler.h"
#include "kernels/maps/map_kind.h"

namespace reliefbench {

/// Map kinds with a compute-shader baker.
[[nodiscard]] std::span<const MapKind> gpu_bakers();

/// Corrections that they make, of those that a map kind has.
[[nodiscard]] std::span<const Correction> gpu_corrections();

/// The compute shader of a map kind. throws: Error(bad_input): a kind that gpu_bakers() has not
[[nodiscard]] Spirv compile_baker(MapKind kind, Dialect dialect);

/// The compute-shader baker of a map kind, compiled once. The search runs in the shader; the host builds the pyramid
/// before it and takes the square root, the rounding to float and the 3x3 minimum after it.
class GpuBaker {
 public:
  /// dialect: of the backend's row
  /// throws: Error(bad_input): a kind that gpu_bakers() has not; Error(environment): a device without doubles in
  /// shaders
  GpuBaker(Backend& backend, Dialect dialect, MapKind kind);

  /// What MapRow::bake gives; `threads` counts for nothing. It has the bits of the CPU's baker on every device whose
  /// double additions and products round to nearest: divisions are put right in the shader (bake_common.glsl).
  /// throws: Error(bad_input) as the CPU's baker does, or for a correction that gpu_corrections() has not;
  /// Error(environment): the map is too large for the device's buffers
  [[nodiscard]] std::vector<float> bake(const BakeRequest& request) const;

 private:
  Backend& backend_;
  MapKind kind_;
  std::unique_ptr<Pipeline> pipeline_;
};

}  // namespace reliefbench
