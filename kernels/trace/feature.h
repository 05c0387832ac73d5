#pragma once
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "kernels/trace/param.h"

namespace reliefbench {

class Settings;

/// One value of a feature, with what it brings into a setting.
struct FeatureRow {
  std::string_view id;
  std::string_view description;
  std::string_view source{};
  std::vector<Param> params{};  ///< of its own: they mean something only where this row is chosen
  std::string_view shader{};    ///< kernels/shaders/<shader>; "": common.glsl has it
  std::string_view caveat{};    ///< what it takes off a technique's guarantee, in words; "": nothing
  /// What it needs of the other rows and these settings do not have, in words; "" if nothing. Null: it needs nothing.
  std::string (*lacks)(const Settings& settings) = nullptr;
};

/// What a setting chooses beside its technique and the storage of its map: one row of each feature that the technique
/// has. The parameter of the feature's id names the row; the rows' own parameters follow it, the last row's first.
struct Feature {
  std::string_view id;
  std::string_view description;
  std::vector<FeatureRow> rows;  ///< the first is the plainest
  int constant_id = -1;          ///< specialization constant that all techniques share; -1: one of each technique's own
  bool is_spelt_out = true;      ///< ids have the plainest row too, as those of the first two features do
  bool is_of_all = false;        ///< every technique that reads a map has it, after all its other parameters
};
[[nodiscard]] const std::vector<Feature>& all_features();

/// How a technique has a feature: one that is not of all among its own parameters, one that is other than usual.
struct FeatureUse {
  std::string_view feature;
  std::string_view fallback{};                                ///< id of the row that is its default; "": the plainest
  std::string_view active_if{};                               ///< as in Param
  std::vector<std::pair<std::string_view, int>> fallbacks{};  ///< of rows' own parameters, where it has others
  bool is_absent = false;                                     ///< the technique has nothing to do with it
};
[[nodiscard]] std::vector<Param> params_of(const FeatureUse& use);

/// The row that these settings choose on each feature that they have, in the order of all_features().
[[nodiscard]] std::vector<const FeatureRow*> rows_of(const Settings& settings);
/// The first thing that one of the rows lacks, "" if none does.
[[nodiscard]] std::string lacking(const std::vector<const FeatureRow*>& rows, const Settings& settings);

}  // namespace reliefbench
