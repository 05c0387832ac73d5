#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace reliefbench {

/// Raised when the same history may give other changes than before.
inline constexpr int kChangesVersion = 2;

struct ChangeOptions {
  std::size_t least_nights = 4;  ///< of a level
  double least_effect = 0.015;   ///< a shift whose interval does not exclude this matters to nobody
  double confidence = 0.95;      ///< of the effect's interval
  double told_p = 1;             ///< that a step must have to be told, of all that are found: for smallest_shift
};

/// Nights of one level, [first, end).
struct Level {
  std::size_t first = 0;
  std::size_t end = 0;
  double log_value = 0;
  double standard_error = 0;
};

/// From one level to the next.
struct Shift {
  std::size_t at = 0;        ///< first night of the new level, most likely
  std::size_t earliest = 0;  ///< an interval of it
  std::size_t latest = 0;
  double log_ratio = 0;  ///< new / old
  double low = 0;        ///< interval of log_ratio, at the options' confidence
  double high = 0;
  double p = 1;          ///< corrected for the choice of the night and for autocorrelation
  bool matters = false;  ///< the interval excludes least_effect on its side
};

/// A trend that is no step.
struct Drift {
  double log_ratio_per_night = 0;  ///< Theil-Sen
  double low = 0;
  double high = 0;
  double p = 1;
};

struct SeriesChanges {
  std::vector<Level> levels;        ///< at least one where there are nights
  std::vector<Shift> shifts;        ///< between levels
  std::vector<std::size_t> spikes;  ///< nights that stand alone
  std::optional<Drift> drift;       ///< where it is significant and no shift explains it
  double sigma = 0;                 ///< of a night's log value about its level, or about the drift
  double autocorrelation = 0;       ///< at lag one
  double smallest_shift = 0;        ///< as a share: what would be found and matter within 5 nights in 9 of 10 cases
};

/// Steps in one series of nights. A step is found (in `shifts`) where one such series in 2,000 without a step would
/// show one, at one look; whether it matters is another question. A new level shows from its least_nights-th night on;
/// until then its nights are spikes. Where a line is the better account than levels, there is a drift and no shift.
///
/// Spikes are left out (lone_values); the rest are levels (LevelFit), whose noise is at least the median standard
/// error. What that finds and misses in made-up histories is printed by tests/changes_test.cpp. What misleads it: noise
/// that triples for a while makes steps in a tenth of the series, and autocorrelation cannot be known from few nights.
///
/// log_values: of each night's drift-corrected median, by time, finite; standard_errors: of each, from within its night
/// and at least what the timer's tick makes of it (tick / sqrt(12)), 0 where unknown; both of one epoch
[[nodiscard]] SeriesChanges find_changes(std::span<const double> log_values, std::span<const double> standard_errors,
                                         const ChangeOptions& options);

}  // namespace reliefbench
