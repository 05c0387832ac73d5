#pragma once
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "backends/backend.h"
#include "backends/shader_compiler.h"
#include "kernels/maps/map_kind.h"
#include "kernels/maps/map_texture.h"

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

/// What a baker packs its maps as.
struct BakePacking {
  const Format& format;
  const Encoding& encoding;
  double relief_depth = 0.1;  ///< for a format with normals
};
/// Whether it can: not as blocks, and not without doubles.
[[nodiscard]] bool can_pack(const Format& format, BakeDevice device);

/// The compute shaders that a map kind's baker runs, by name.
/// throws: Error(bad_input): a kind that gpu_bakers() has not, or one that needs doubles which the device has not
[[nodiscard]] std::map<std::string, Spirv> compile_baker(MapKind kind, Dialect dialect, BakeDevice device,
                                                         const std::optional<BakePacking>& packing = {});

/// A map that a GPU baked.
struct GpuBake {
  std::vector<float> values{};            ///< what MapRow::bake gives; none where it is packed
  std::optional<MapTextures> textures{};  ///< what pack_map() makes of them, where the baker packs
  /// On the device's clock: upload, refine, pyramid, search, correction, pack, read_back.
  std::vector<ComputeTime> times{};
  double transport_ns = 0;  ///< ComputeResult::transport_ns
};

class BakePasses;

/// The compute-shader baker of a map kind, compiled once. All of the work is the device's: the pyramid, the search, the
/// roots and their rounding, the 3x3 minimum, and codes and textures where it packs.
class GpuBaker {
 public:
  /// dialect: of the backend's row
  /// packing: what it packs its maps as, where it can
  /// throws: Error(bad_input): a kind that gpu_bakers() has not; Error(environment): a device that has no doubles for a
  /// kind that needs them, or no compute
  GpuBaker(Backend& backend, Dialect dialect, MapKind kind, const std::optional<BakePacking>& packing = {});
  /// device: instead of what the backend's is
  GpuBaker(Backend& backend, Dialect dialect, MapKind kind, BakeDevice device,
           const std::optional<BakePacking>& packing = {});

  /// `threads` counts for nothing. With doubles the map has the bits of the CPU's baker on every device whose double
  /// additions, products and conversions round to nearest: divisions and roots are put right in the shader.
  /// throws: Error(bad_input) as the CPU's baker does; Error(environment): the map is too large for the device's
  /// buffers
  [[nodiscard]] GpuBake bake(const BakeRequest& request) const;

 private:
  /// returns: the buffer that the map's values are left in
  int add_values(BakePasses& passes, Correction correction) const;
  /// None: the device cut a search short.
  [[nodiscard]] std::optional<GpuBake> bake_once(const BakeRequest& request, int patience) const;

  Backend& backend_;
  MapKind kind_;
  BakeDevice device_;
  std::optional<BakePacking> packing_;  ///< none: it gives values
  std::map<std::string, std::unique_ptr<Pipeline>> pipelines_;
};

}  // namespace reliefbench
