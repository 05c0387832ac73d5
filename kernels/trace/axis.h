#pragma once
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "kernels/trace/param.h"

namespace reliefbench {

class Settings;

/// One value of an axis, with what it brings into a setting.
struct AxisRow {
  std::string_view id;
  std::string_view description;
  std::string_view source{};
  std::vector<Param> params{};    ///< of its own: they mean something only where this row is chosen
  std::string_view shader{};      ///< kernels/shaders/<shader>; "": common.glsl has it
  std::string_view caveat{};      ///< what it takes off a technique's guarantee, in words; "": nothing
  /// What it needs of the other rows and these settings do not have, in words; "" if nothing. Null: it needs nothing.
  std::string (*lacks)(const Settings& settings) = nullptr;
};

/// What a setting chooses beside its technique and the storage of its map: one row of each axis that the technique has.
/// The parameter of the axis's id names the row; the rows' own parameters follow it, the last row's first.
struct Axis {
  std::string_view id;
  std::string_view description;
  std::vector<AxisRow> rows;  ///< the first is the plainest
  int constant_id = -1;       ///< specialization constant that all techniques share; -1: one of each technique's own
  bool is_spelt_out = true;   ///< ids have the plainest row too, as those of the first two axes do
};
[[nodiscard]] const std::vector<Axis>& axes();

/// How a technique has an axis.
struct AxisUse {
  std::string_view axis;
  std::string_view fallback{};   ///< id of the row that is its default; "": the plainest
  std::string_view active_if{};  ///< as in Param
  std::vector<std::pair<std::string_view, int>> fallbacks{};  ///< of rows' own parameters, where it has others
};
[[nodiscard]] std::vector<Param> params_of(const AxisUse& use);

/// The row that these settings choose on each axis that they have, in the order of axes().
[[nodiscard]] std::vector<const AxisRow*> rows_of(const Settings& settings);
/// The first thing that one of the rows lacks, "" if none does.
[[nodiscard]] std::string lacking(const std::vector<const AxisRow*>& rows, const Settings& settings);

}  // namespace reliefbench
