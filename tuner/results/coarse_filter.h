#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/trace/technique.h"

namespace reliefbench {

/// A device whose sampler filters some types of texel more coarsely than GPUs do: errors that it showed of settings
/// that read them with filter=hardware are its own, and a GPU's are less.
class CoarseFilter {
 public:
  /// A device that filters as GPUs do.
  CoarseFilter() = default;
  /// The device of a backend in a run. An older run does not say how it filters: nothing of it is marked.
  /// info: run.json
  CoarseFilter(const nlohmann::json& info, std::string_view backend);

  /// Whether the error of these settings rests on it.
  [[nodiscard]] bool made_error_of(const Settings& settings) const;
  /// kMark or nothing, to follow the name of a setting. id: of a setting or case
  [[nodiscard]] std::string_view mark(std::string_view id) const;
  /// What the mark means, in a line; "" where nothing is marked.
  [[nodiscard]] std::string note() const;

  static constexpr std::string_view kMark = " *";

 private:
  std::string device_;               ///< with its backend
  std::vector<std::string> texels_;  ///< texel_type_id() of those that it filters coarsely
  double worst_ = 0;                 ///< that these are off by
};

}  // namespace reliefbench
