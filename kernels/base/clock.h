#pragma once
#include <string>

namespace reliefbench {

inline constexpr double kNsPerMs = 1e6;

[[nodiscard]] double unix_ns();  ///< now, ns since 1970
/// "2026-11-22T12:00:00Z" of ns since 1970.
[[nodiscard]] std::string utc_text(double time_ns);

}  // namespace reliefbench
