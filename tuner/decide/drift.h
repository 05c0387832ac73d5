#pragma once
#include <cstddef>
#include <optional>
#include <span>

#include "tuner/decide/changes.h"

namespace reliefbench {

/// A trend of values at rising nights, where there is one at this p: Mann and Kendall's test, its variance corrected
/// for autocorrelation at lag one of what is left about a line. Its slope and interval are Theil and Sen's.
/// source: Sen, "Estimates of the regression coefficient based on Kendall's tau", 1968; Hamed & Rao, "A modified
/// Mann-Kendall trend test for autocorrelated data", 1998
[[nodiscard]] std::optional<Drift> find_drift(std::span<const std::size_t> nights, std::span<const double> values,
                                              double most_p, double confidence);

/// Sum of squares about the least squares line.
[[nodiscard]] double squares_about_line(std::span<const std::size_t> nights, std::span<const double> values);

}  // namespace reliefbench
