#pragma once
#include <cstdint>

#include "tuner/search/recorded_table.h"

namespace reliefbench {

/// A made-up exhaustive sweep that looks like a real one: chains of a technique, a format and a filter with lattices of
/// march and refinement steps; times of 1 to 40 ms that saturate as rays exit early; formats that are near ties.
struct SyntheticTable {
  std::uint64_t seed = 1;
  int techniques = 10;
  int formats = 4;
  int filters = 2;
  int marches = 7;              ///< step counts from 4 up, each about 2 times the last
  int refinements = 3;          ///< 0, 3, 6, ...
  int samples = 30;             ///< recorded, a setting
  double slow_noise = 0.01;     ///< standard deviation of log time of the slowest settings
  double fast_noise = 0.03;     ///< of the fastest
  double outlier_share = 0.01;  ///< of samples
  double outlier_size = 0.3;    ///< an outlier is up to so much slower, as a ratio - 1
  double fast_share = 0;        ///< of the samples of every fourth setting: corrected for a drift that was none, 0.5 of
                                ///< their time
  double interaction = 0;       ///< 0: log time is additive; else the size of a random factor of each chain
  double non_monotone = 0;      ///< how much faster, in log time, more steps can be
};
/// The same on every standard library.
[[nodiscard]] RecordedTable synthetic_table(const SyntheticTable& options);

/// The two tables on which the guarantee is tested, a few hundred settings each.
[[nodiscard]] RecordedTable additive_table();
[[nodiscard]] RecordedTable non_additive_table();  ///< strong interactions, 5 % outliers, more steps at times faster
[[nodiscard]] RecordedTable table_with_fast_outliers();

}  // namespace reliefbench
