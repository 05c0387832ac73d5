#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace reliefbench {

/// When a parameter takes effect. A map is baked once for all run-time values.
enum class Stage { bake, run };

/// Param::constant_id of what no shader has in its text.
inline constexpr int kNoConstant = -2;

/// One axis of the space: an integer range, or a list of named choices (its value is then the index).
struct Param {
  std::string_view id;
  std::string_view description;
  Stage stage = Stage::run;
  int min = 0;
  int max = 0;
  int fallback = 0;                         ///< the default
  std::vector<std::string_view> choices{};  ///< empty for a range
  std::string active_if{};   ///< "", "param=choice" or "param=choice|choice": else it means nothing and is left out
  int constant_id = -1;      ///< specialization constant; -1: none yet, or never (most bake parameters, format)
  bool is_constant = false;  ///< has one though it is of the bake
  bool is_spelt_out = true;  ///< ids have the default too; else only another value

  [[nodiscard]] std::string text(int value) const;
  /// "12", or a choice's name. throws: Error(bad_input) with what was expected
  [[nodiscard]] int parse(std::string_view text) const;
  /// throws: Error(bad_input) if the value is out of range
  void check(int value) const;
  [[nodiscard]] bool counts_steps() const { return stage == Stage::run && choices.empty(); }
};

[[nodiscard]] Param range_param(std::string_view id, std::string_view description, int min, int max, int fallback);
/// fallback: one of the choices
[[nodiscard]] Param choice_param(std::string_view id, std::string_view description,
                                 std::vector<std::string_view> choices, std::string_view fallback);

}  // namespace reliefbench
