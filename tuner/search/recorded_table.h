#pragma once
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tuner/search/space.h"

namespace reliefbench {

/// An exhaustive sweep of one scene on one device, as replay needs it.
struct RecordedTable {
  SearchSpace space;
  std::string backend;
  std::string device;
  std::string scene;
  std::string scene_key{};  ///< hex digits; "": unknown
  std::string error_metric;
  std::vector<std::string> constraints;      ///< Budget::text(), behind Candidate::is_feasible
  std::optional<double> asked_error{};       ///< the sweep's own bound on error_metric; none: it has none
  std::string nearest{};                     ///< where no candidate is feasible: the id of the one that misses least
  std::string miss{};                        ///< and by how much
  std::vector<std::vector<double>> samples;  ///< ns a frame, corrected for drift; one list a candidate, none empty
  std::vector<std::int64_t> memory_bytes{};  ///< of each candidate's map
};

/// A random part of the settings, as if there were no others: so many as the share makes, one at least. The same for
/// the same seed. share: in (0, 1]; 1: all of them
[[nodiscard]] RecordedTable random_part(const RecordedTable& table, double share, std::uint64_t seed);

/// The time that the search estimates: the expectation of the log of the median of three samples drawn with
/// replacement, exactly, from the order statistics.
[[nodiscard]] double true_log_time(std::span<const double> samples);

/// Draws a candidate's recorded samples with replacement. The draw is a function of (seed, candidate, index) alone, so
/// that a search that was killed meets the same noise again.
///
/// With a correlation, samples of one block (kBlock of a candidate in a row) are tied together as those of a loaded
/// machine are: each is with probability sqrt(correlation) a draw that the block shares, so that any two of a block
/// have that intraclass correlation, outliers included, while each by itself is distributed as recorded:
/// true_log_time() holds for every correlation.
class ReplaySource final : public TimeSource {
 public:
  /// correlation: in [0, 1]
  ReplaySource(const RecordedTable& table, std::uint64_t seed, double correlation = 0)
      : table_(table), seed_(seed), shared_(std::sqrt(correlation)) {}
  [[nodiscard]] double frame_ns(std::size_t candidate, int index) override;

 private:
  const RecordedTable& table_;
  std::uint64_t seed_;
  double shared_;  // chance that a sample is its block's
};

}  // namespace reliefbench
