#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/maps/map_storage.h"
#include "kernels/maps/mip_chain.h"
#include "kernels/trace/feature.h"
#include "kernels/trace/param.h"

namespace reliefbench {

/// Specialization constants of common.glsl. A technique's own begin at kFirstOwnConstant, in the order of its row.
enum SharedConstant : int {
  kWrapConstant,
  kFilterConstant,
  kEncodingConstant,
  kLoopConstant,
  kLayoutConstant,
  kConeFetchConstant,
  kSamplerShiftConstant,
  kSamplerErrorConstant,
  kSimulatedBitsConstant,
  kSimulatedWeightsConstant
};
inline constexpr std::uint32_t kFirstOwnConstant = 16;
/// Those of features of the scene, which are the same for all techniques, begin here.
inline constexpr std::uint32_t kFirstFeatureConstant = 128;
/// Whether it is a parameter of a feature of the scene's row.
[[nodiscard]] constexpr bool is_of_scenes_row(const Param& param) {
  return param.constant_id >= static_cast<int>(kFirstFeatureConstant);
}

/// How a technique has the storage of its map: `map` where it runs on several kinds with more than heights, the kinds'
/// own parameters, `correction`, `max_ratio`, `format`, `encoding`, each where one of its maps has a use for it.
struct StorageUse {
  std::string_view format;               ///< the default
  std::string_view correction = "none";  ///< the default
  std::string_view active_if{};          ///< of all but the format, as in Param
  bool has_max_ratio = true;             ///< false: no cone is wider than 1
};

/// A technique: one row, and one shader file `kernels/shaders/<id>.glsl` that defines `Hit trace(Ray)`.
struct Technique {
  std::string_view id;
  std::string_view description;
  std::vector<MapKind> maps;           ///< that it can run on; the first is the default, the parameter `map` chooses
  std::vector<Param> params;           ///< of its own; in techniques() followed by those of storage and features
  std::optional<StorageUse> storage;   ///< none: it reads no map
  std::vector<FeatureUse> features{};  ///< of those of all, the ones that it has in another way
  Guarantee guarantee;                 ///< the most that any of its settings keep of primary rays
  std::string_view guarantee_note;     ///< when it holds, or what may go wrong
  std::string_view source;
  /// What these settings guarantee of primary rays, with either filter, on the heights as stored; null: nothing.
  Guarantee (*guarantee_when)(const Settings& settings) = nullptr;
  /// Share of pixels in which two devices may differ by more than rounding: where an ulp decides what a ray meets.
  double disagreement = 0.01;
  std::string_view passes{};  ///< the parameter that says how many draws its frame has (passes_of); "": one

  [[nodiscard]] const Param* find(std::string_view param_id) const;
  [[nodiscard]] bool reads_map() const { return storage.has_value(); }
  /// Whether it traces solids, heights with floors, and those alone: its rays may pass.
  [[nodiscard]] bool is_of_solids() const { return find_map(maps.front()).is_solid; }
};
[[nodiscard]] const std::vector<Technique>& techniques();
[[nodiscard]] const Technique& find_technique(std::string_view id);  ///< throws: Error(bad_input) listing the choices

/// A parameter that means something in a setting, with its value there.
struct SettingValue {
  const Param& param;
  int value;
  [[nodiscard]] std::string text() const { return param.text(value); }
  /// Whether ids have it: not a default that is not spelt out.
  [[nodiscard]] bool is_written() const { return param.is_spelt_out || value != param.fallback; }
};

/// A value for every active parameter of a technique's row and of those that it spans: storage of the map, features.
/// Inactive parameters are absent, so equal work has equal settings: there are no duplicates in the space.
class Settings {
 public:
  explicit Settings(const Technique& technique);   ///< the defaults
  void set(std::string_view param_id, int value);  ///< throws: Error(bad_input): no such parameter, out of range
  void set(std::string_view param_id, std::string_view text);  ///< "12" or a choice's name
  [[nodiscard]] int get(std::string_view param_id) const;      ///< value, the default where inactive
  [[nodiscard]] std::string_view choice(std::string_view param_id) const;
  [[nodiscard]] bool is_active(const Param& param) const;
  /// The parameter of that id, where the technique has it and it is active; else null.
  [[nodiscard]] const Param* active(std::string_view param_id) const;
  /// Whether that parameter is active and has that choice.
  [[nodiscard]] bool is(std::string_view param_id, std::string_view choice_id) const;
  /// The active parameters, in the row's order.
  [[nodiscard]] std::vector<SettingValue> values() const;
  /// Those of them that ids have.
  [[nodiscard]] std::vector<SettingValue> written() const;
  /// "linear_steps=16&refinement=binary&..." of what is written.
  [[nodiscard]] std::string text() const;
  [[nodiscard]] const Technique& technique() const { return *technique_; }
  bool operator==(const Settings& other) const { return technique_ == other.technique_ && text() == other.text(); }

 private:
  [[nodiscard]] std::size_t place_of(std::string_view param_id) const;  ///< throws: Error(bad_input)

  const Technique* technique_;
  std::vector<int> values_;  ///< parallel to technique_->params
};

/// The map kind of these settings.
[[nodiscard]] const MapRow& map_of(const Settings& settings);
/// The values of the map's own parameters.
[[nodiscard]] std::vector<MapValue> map_values(const Settings& settings);
/// How these settings' map is stored; of a technique that reads none, any way that heights can be.
[[nodiscard]] MapStorage storage_of(const Settings& settings);
/// Whether a ray may read coarser levels of the map than its base.
[[nodiscard]] bool reads_levels(const Settings& settings);
/// Those levels: conservative where the technique promises something, else means.
[[nodiscard]] Mips mips_of(const Settings& settings);
/// Whether a ray may begin anywhere in its first step, so that a shader is told where.
[[nodiscard]] bool is_dithered(const Settings& settings);
/// Whether a compute shader puts the frame's pixels (dispatch=compute).
[[nodiscard]] bool is_by_compute(const Settings& settings);
/// How many frames a ray's beginning goes through (dither=temporal).
inline constexpr int kDitherFrames = 8;
/// How many frames' mean is what people see of these settings: kDitherFrames, or 1.
[[nodiscard]] int frames_seen(const Settings& settings);
/// The most steps that a ray may take: the sum of all counts of steps, and one more where it is dithered.
[[nodiscard]] int step_cap(const Settings& settings);
/// What they guarantee of a ray that is traced for this: the technique of primary rays, a feature's row of others.
[[nodiscard]] Guarantee guarantee_of(const Settings& settings, Query query = Query::primary);

/// Whether no point of the surface as stored stands in a cone of these settings' map, interpolated ones included: rays
/// from anywhere may rely on it, not only those from the top plate. Not so of plain steps through a sector map that the
/// sampler filters.
[[nodiscard]] bool has_free_cones(const Settings& settings);

/// Whether they read with the sampler's filter and guarantee something: then they make up for what it is off by.
[[nodiscard]] bool makes_up_for_filter(const Settings& settings);

/// Why these settings make no sense together, or "" if they do (a one-channel format for a cone map, a correction
/// that the map kind does not have, a feature whose row lacks what it needs).
[[nodiscard]] std::string conflict(const Settings& settings);
/// Why they make no sense on heights that have floors, or have none; "" if they do.
[[nodiscard]] std::string heights_conflict(const Settings& settings, bool is_solid);
/// Why they make no sense in this scene, or "" if they do: a silhouette on a plane, passes or a solid on a sphere.
[[nodiscard]] std::string conflict(const Settings& settings, const Scene& scene, bool is_solid);

}  // namespace reliefbench
