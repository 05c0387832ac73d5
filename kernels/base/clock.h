#pragma once
#include <string>

namespace reliefbench {

inline constexpr double kNsPerMs = 1e6;
inline constexpr double kMsPerNs = 1e-6;

inline constexpr double kLeastUnixSeconds = -62135596800;  ///< the year 1
inline constexpr double kMostUnixSeconds = 253402300800;   ///< the year 10000, which is no longer written in 4 digits

[[nodiscard]] double steady_ns();  ///< now, of a clock that nobody sets
[[nodiscard]] double unix_ns();    ///< now, ns since 1970
/// "2026-11-22T12:00:00Z" of ns since 1970, of years from 1 to 9999: what is outside of them is brought into them.
[[nodiscard]] std::string utc_text(double time_ns);

}  // namespace reliefbench
