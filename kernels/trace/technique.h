#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/maps/map_storage.h"

namespace reliefbench {

/// When a parameter takes effect. A map is baked once for all run-time values.
enum class Stage { bake, run };

/// One axis of the space: an integer range, or a list of named choices (its value is then the index).
struct Param {
  std::string_view id;
  std::string_view description;
  Stage stage = Stage::run;
  int min = 0;
  int max = 0;
  int fallback = 0;                         ///< the default
  std::vector<std::string_view> choices{};  ///< empty for a range
  std::string_view active_if{};  ///< "" or "param=choice": otherwise the parameter means nothing and is left out
  int constant_id = -1;          ///< specialization constant; -1: none (bake parameters, format)

  [[nodiscard]] std::string text(int value) const;
};

/// Specialization constants of common.glsl. A technique's own begin at kFirstOwnConstant, in the order of its row.
enum SharedConstant : int {
  kWrapConstant,
  kFilterConstant,
  kEncodingConstant,
  kLoopConstant,
  kLayoutConstant,
  kConeFetchConstant
};
inline constexpr std::uint32_t kFirstOwnConstant = 16;

/// A claim that the tests and the stability suite hold a technique to.
enum class Guarantee {
  none,
  never_skips,  ///< the first hit is never stepped over
  exact,        ///< nor is a ray left short of it, while its step cap is not reached
};
[[nodiscard]] std::string_view guarantee_id(Guarantee guarantee);

/// A technique: one row, and one shader file `kernels/shaders/<id>.glsl` that defines `Hit trace(Ray)`.
struct Technique {
  std::string_view id;
  std::string_view description;
  std::vector<MapKind> maps;  ///< that it can run on; the first is the default, the parameter `map` chooses
  std::vector<Param>
      params;           ///< every axis of this technique, those it shares with others included, in id order of use
  Guarantee guarantee;  ///< the most that any of its settings keep
  std::string_view guarantee_note;  ///< when it holds, or what may go wrong
  std::string_view source;
  /// What these settings guarantee, with the manual filter, on the heights as stored; null: nothing.
  Guarantee (*guarantee_when)(const class Settings& settings) = nullptr;
  /// Share of pixels in which two devices may differ by more than rounding: where an ulp decides what a ray meets.
  double disagreement = 0.01;

  [[nodiscard]] const Param* find(std::string_view param_id) const;
};
[[nodiscard]] const std::vector<Technique>& techniques();
[[nodiscard]] const Technique& find_technique(std::string_view id);  ///< throws: Error(bad_input) listing the choices

/// A value for every active parameter of one technique. Inactive parameters are absent, so equal work has equal
/// settings: there are no duplicates in the space.
class Settings {
 public:
  explicit Settings(const Technique& technique);   ///< the defaults
  void set(std::string_view param_id, int value);  ///< throws: Error(bad_input): no such parameter, out of range
  void set(std::string_view param_id, std::string_view text);  ///< "12" or a choice's name
  [[nodiscard]] int get(std::string_view param_id) const;      ///< value, the default where inactive
  [[nodiscard]] std::string_view choice(std::string_view param_id) const;
  [[nodiscard]] bool is_active(const Param& param) const;
  /// "linear_steps=16&refinement=binary&..." over the active parameters, in the row's order.
  [[nodiscard]] std::string text() const;
  [[nodiscard]] const Technique& technique() const { return *technique_; }
  bool operator==(const Settings& other) const { return text() == other.text(); }

 private:
  const Technique* technique_;
  std::vector<int> values_;  ///< parallel to technique_->params
};

/// The map kind of these settings.
[[nodiscard]] const MapRow& map_of(const Settings& settings);
[[nodiscard]] Guarantee guarantee_of(const Settings& settings);

/// How these settings' map is stored. The technique must have a `format`.
[[nodiscard]] MapStorage storage_of(const Settings& settings);

/// Why these settings make no sense together, or "" if they do (a one-channel format for a cone map, a correction
/// that the map kind does not have).
[[nodiscard]] std::string conflict(const Settings& settings);

}  // namespace reliefbench
