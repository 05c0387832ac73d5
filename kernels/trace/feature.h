#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "kernels/trace/param.h"

namespace reliefbench {

struct FrameScore;
struct FrameUniforms;
struct PixelScore;
struct ReferenceHit;
struct Scene;
struct ScorePixel;
struct Surface;
struct TextureRay;
class ReferenceTracer;
class Settings;

/// What a ray is traced for.
enum class Query { primary, shadow, depth };

/// A claim that the tests and the stability suite hold a technique or a feature's row to.
enum class Guarantee {
  none,
  never_skips,  ///< the first hit is never stepped over
  exact,        ///< nor is a ray left short of it, while its step cap is not reached
};
[[nodiscard]] std::string_view guarantee_id(Guarantee guarantee);

/// One row of a feature, with what it brings into a setting.
struct FeatureRow {
  std::string_view id;
  std::string_view description;
  std::string_view source{};
  std::vector<Param> params{};  ///< of its own: they mean something only where this row is chosen
  /// kernels/shaders/<shader>; "": common.glsl has it. Of a feature with a PixelValue it defines
  /// `float <PixelValue::function>(Ray ray, Scene scene, inout Hit hit)`.
  std::string_view shader{};
  std::vector<std::string_view> defines{};  ///< macros of Hook::silhouette
  std::string_view caveat{};                ///< what it takes off a technique's guarantee, in words; "": nothing
  bool keeps_guarantee = true;              ///< of primary rays; false: nothing is left of it
  /// What people see with it beside the feature itself: a scene may require the one without the other. "": nothing
  std::string_view also{};
  /// What it needs of the other rows and these settings do not have, in words; "" if nothing. Null: it needs nothing.
  std::string (*lacks)(const Settings& settings) = nullptr;
  /// What it needs of the scene and this one does not have, likewise.
  std::string (*lacks_in)(const Scene& scene) = nullptr;
  /// What it guarantees with these settings of rays that are traced for PixelValue::query; null: nothing.
  Guarantee (*guarantee_when)(const Settings& settings) = nullptr;
};

/// What a feature of the scene makes of every pixel after its hit: a number. Frames have the text of the rows that are
/// chosen, and no other; where the plainest row is chosen, nothing at all.
struct PixelValue {
  /// kernels/shaders/<shader>: how it shades a pixel, `void shade_<feature>(float value, inout Shading shading)`
  std::string_view shader;
  std::string_view function;  ///< of the rows' shaders, whose result it is
  std::string_view meaning;   ///< of the number
  std::string_view output;    ///< where score frames have it, one float a pixel
  Query query;
  int version;  ///< of `exact`: raised when a value changes
  /// The exact value of each pixel. rays, hits: exact ones of the frame's pixels
  std::vector<float> (*exact)(const ReferenceTracer& tracer, const FrameUniforms& frame,
                              std::span<const TextureRay> rays, std::span<const ReferenceHit> hits);
  /// How many pixels of a frame break a guarantee, whichever it is. tracer: of the heights as they are stored
  std::int64_t (*broken)(const ReferenceTracer& tracer, const FrameUniforms& frame, std::span<const ScorePixel> pixels,
                         std::span<const float> found);
  bool has_objects = false;  ///< the shaded frame has depth, and other objects beside the relief (objects.frag)
};

/// Where a feature of the scene without a PixelValue comes in.
enum class Hook {
  none,
  way,         ///< before the ray is traced: rows define `void begin_<feature>(inout Way way)`, see way.glsl
  normal,      ///< where the normal is read: rows define `vec4 normal_texel(vec2 uv, Pixel pixel)`
  silhouette,  ///< in the frame of a curved surface: rows say what surface_frame.glsl is compiled with (`defines`)
};

/// Surfaces that a feature of the scene makes sense on, and has an exact reference for.
enum class Ground {
  any,
  no_mesh,  ///< what is given by numbers
  curved,
};

/// What a setting chooses beside its technique and the storage of its map: one row of each feature that the technique
/// has. The parameter of the feature's id names the row; the rows' own parameters follow it, the last row's first. One
/// that several rows have is the same to all of them.
struct Feature {
  std::string_view id;
  std::string_view description;
  std::vector<FeatureRow> rows;  ///< the first is the plainest
  /// Specialization constant that all techniques share; -1: one of each technique's own; kNoConstant: none.
  int constant_id = -1;
  bool is_spelt_out = true;  ///< ids have the plainest row too, as those of the first two features do
  bool is_of_all = false;    ///< every technique that reads a map has it, after all its other parameters
  /// It is something of what is seen, not of how a hit is found: its parameters stand behind all others, frames have
  /// the text of the row that is chosen and of no other, and a scene may require it (tuner/decide/require.h).
  bool is_of_scene = false;
  bool needs_map = true;  ///< false: `flat` has it, too
  Ground ground = Ground::any;
  Hook hook = Hook::none;
  std::optional<PixelValue> value{};  ///< of a feature of the scene; its rows' constants are all techniques' own
};
[[nodiscard]] const std::vector<Feature>& all_features();

/// How a technique has a feature: one that is not of all among its own parameters, one that is other than usual.
struct FeatureUse {
  std::string_view feature;
  std::string_view fallback{};                                ///< id of the row that is its default; "": the plainest
  std::string_view active_if{};                               ///< as in Param
  std::vector<std::pair<std::string_view, int>> fallbacks{};  ///< of rows' own parameters, where it has others
  bool is_absent = false;                                     ///< the technique has nothing to do with it
  bool is_spelt_out = false;                                  ///< ids have the plainest row, too
};
[[nodiscard]] std::vector<Param> params_of(const FeatureUse& use);

/// The row that these settings choose on each feature that they have, in the order of all_features().
[[nodiscard]] std::vector<const FeatureRow*> rows_of(const Settings& settings);
/// A feature that is on, with the row that is chosen; null: the exact values, in the reference picture.
struct PixelFeature {
  const Feature* feature;
  const FeatureRow* row;
};
/// A list of values for each of some features, one a pixel.
using FeatureValues = std::vector<std::vector<float>>;
/// The features that are on in these settings: another row than the plainest is chosen.
[[nodiscard]] std::vector<PixelFeature> chosen_features(const Settings& settings);
/// All features of the scene that are on in these settings: what a frame's text is made of.
[[nodiscard]] std::vector<PixelFeature> frame_features(const Settings& settings);
/// Those that have a PixelValue.
[[nodiscard]] std::vector<PixelFeature> with_values(std::span<const PixelFeature> features);
/// with_values() of frame_features().
[[nodiscard]] std::vector<PixelFeature> pixel_features(const Settings& settings);
/// Whether a feature shows in objects beside the relief, which `require` does not judge by.
[[nodiscard]] bool shows_in_objects(const Feature& feature);
/// Everything that the relief itself may show beside the hits, exact.
[[nodiscard]] std::vector<PixelFeature> exact_features();
/// Whether one of those is traced for this.
[[nodiscard]] bool has_value_of(const Settings& settings, Query query);
/// "shadow=cone&..."; "" where there is none
[[nodiscard]] std::string text_of(std::span<const PixelFeature> features);
/// The features whatever their rows: PixelFeature::row is null.
[[nodiscard]] std::vector<PixelFeature> exact_ones(std::span<const PixelFeature> features);
/// As PixelValue::exact makes them.
[[nodiscard]] FeatureValues exact_values(std::span<const PixelFeature> features, const ReferenceTracer& tracer,
                                         const FrameUniforms& frame, std::span<const TextureRay> rays,
                                         std::span<const ReferenceHit> hits);
/// judge_feature() of each.
void judge_features(std::span<const PixelFeature> features, const FeatureValues& found, const FeatureValues& exact,
                    std::span<const PixelScore> mask, FrameScore& score);

/// The first thing that one of the rows lacks, "" if none does.
[[nodiscard]] std::string lacking(const std::vector<const FeatureRow*>& rows, const Settings& settings);
/// Whether the feature makes sense in such a scene.
[[nodiscard]] bool stands_on(Ground ground, const Surface& surface);
/// The first thing that the scene lacks, "" if it lacks none.
[[nodiscard]] std::string lacking_in(std::span<const PixelFeature> features, const Scene& scene);

}  // namespace reliefbench
