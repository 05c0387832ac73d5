#pragma once
#include <cstddef>

namespace reliefbench {

/// How often a series of independent normal values that has no step seems to have one: P(strongest gain >= gain), of
/// LevelFit after lone_values(), with levels of at least 4. It holds that the step's place was chosen and that the
/// noise was estimated. From a table; beyond its least p, along its last slope of log p over log gain, which no tail
/// here is heavier than.
[[nodiscard]] double null_p(double gain, std::size_t nights);
/// The gain that is exceeded with probability p.
[[nodiscard]] double null_gain(double p, std::size_t nights);

}  // namespace reliefbench
