#pragma once
#include "tuner/search/observations.h"

namespace reliefbench {

/// How closely frames of one block are tied together: the analysis of variance of blocks, pooled over settings.
class BlockCorrelation {
 public:
  /// Adds the deviations of a setting's frames; those beyond kWinsor scales count as so many.
  /// scale: standard deviation of a frame's log time
  void add(const Observed& observed, double scale);

  /// The intraclass correlation, the share of a frame's variance that its whole block has, and kSurely of its standard
  /// errors: in [0, 1]; 1 while no setting has two blocks.
  /// source: Donner, "A review of inference procedures for the intraclass correlation coefficient in the one-way random
  /// effects model", 1986
  [[nodiscard]] double upper_estimate() const;

  static constexpr double kWinsor = 5;
  static constexpr double kSurely = 2;

 private:
  double between_ = 0;  // sums of squares
  double between_degrees_ = 0;
  double within_ = 0;
  double within_degrees_ = 0;
};

}  // namespace reliefbench
