#pragma once
#include <string>

#include "tuner/history/rows.h"

namespace reliefbench {

/// A series as people read it: "cone cone_steps=64 [4cc2dca1] in rocks/oblique, vulkan". A benchmark, or a case that
/// this build does not know any more, has the name that it was stored with.
[[nodiscard]] std::string series_name(const SeriesRow& series);

/// Of its setting alone: "cone cone_steps=64 [4cc2dca1]".
[[nodiscard]] std::string series_setting_name(const SeriesRow& series);

/// A device as calibrations and series name it: "vulkan llvmpipe (LLVM 15.0.6, 256 bits)".
[[nodiscard]] inline std::string device_name(const std::string& backend, const std::string& name) {
  return backend + ' ' + name;
}

}  // namespace reliefbench
