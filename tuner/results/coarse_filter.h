#pragma once
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <set>
#include <span>
#include <string>
#include <string_view>

#include "kernels/trace/technique.h"

namespace reliefbench {

struct TableRow;

/// A device whose sampler filters some types of texel more coarsely than GPUs do: errors that it showed of settings
/// that read them with filter=hardware are its own, and a GPU's are less.
class CoarseFilter {
 public:
  /// A device that filters as GPUs do.
  CoarseFilter() = default;
  /// The device of a backend in a run. An older run does not say how it filters: nothing of it is marked.
  /// info: run.json
  CoarseFilter(const nlohmann::json& info, std::string_view backend);

  /// Takes what a row of the device's table says of it.
  void add(const TableRow& row);

  /// What it is off by where these settings read a map with it, as a share of the difference of two texels; 0 where
  /// their error does not rest on it.
  [[nodiscard]] double error_of(const Settings& settings) const;
  /// Whether the error of these settings rests on it.
  [[nodiscard]] bool made_error_of(const Settings& settings) const { return error_of(settings) > 0; }
  /// kMark or nothing, to follow the name of a setting. id: of a setting or case
  [[nodiscard]] std::string_view mark(std::string_view id) const;
  /// What the mark means, in a line; "" where nothing is marked.
  [[nodiscard]] std::string note() const;

  static constexpr std::string_view kMark = " *";

 private:
  std::string device_;                                 ///< with its backend
  std::map<std::string, double, std::less<>> texels_;  ///< texel_type_id() of those that it filters coarsely; worst()
};

/// CoarseFilter::kMark or nothing, as the row has it.
[[nodiscard]] std::string_view coarse_mark(const TableRow& row);
/// What the marks of these rows mean, a line for each device that has any.
[[nodiscard]] std::set<std::string> coarse_notes(std::span<const TableRow* const> rows);

}  // namespace reliefbench
