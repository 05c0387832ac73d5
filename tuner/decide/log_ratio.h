#pragma once
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace reliefbench {

/// A case's times in one run.
struct LoggedTimes {
  std::vector<double> logs;  ///< of its times, one a sample
  std::vector<int> rounds;   ///< parallel: what was sampled in one round shares what the machine did then
  int block = 0;             ///< cases of a block were sampled in the same rounds
};

/// A case in both runs.
struct RatioCase {
  LoggedTimes base;
  LoggedTimes now;
  std::string family{};              ///< cases that ought to change alike: of one technique
  bool is_same_measurement = false;  ///< both runs hold the very same samples: a copied folder, or one run twice
};

/// Estimate of the log of a ratio of times, or of several ratios' mean.
struct LogRatio {
  double mean = 0;
  double error = std::numeric_limits<double>::infinity();  ///< standard error; 0 for one measurement beside itself
  int df = 0;                                              ///< of Student's t; 0: nothing is known
  double shift = 0;                                        ///< part of the error that more samples would not take away
  [[nodiscard]] double p() const;                          ///< two-sided, of a ratio of 1
  /// Half the width of a confidence interval; infinite where nothing is known.
  [[nodiscard]] double margin(double confidence) const;
};

/// A distance from a centre that should be 0, with the variance that sampling gives it.
struct Residual {
  double square;
  double variance;
};
/// The variance beside that of sampling with which residuals have the median that normal ones have, so that a few that
/// are far off have little say; 0 where sampling explains them.
[[nodiscard]] double excess_variance(std::span<const Residual> residuals);
/// Its degrees of freedom. independent: how many of the residuals are
[[nodiscard]] double excess_df(double independent);

/// Ratios of the cases of one device, and what they can be told apart from.
///
/// A case's log ratio is the difference of two Huber estimates of location. Its error has two parts. That of sampling
/// is the scatter within both runs, of few samples and so moderated by the scatter of all cases (VariancePrior). The
/// other is what shifts a case from one run to the next without a cause (where its map lies in memory, what else the
/// machine does for a while): between_runs(), estimated from how far the ratios of a family scatter about their median
/// beyond what sampling explains, robustly, so that a few changed cases do not hide themselves. It is known only as
/// well as there are cases to estimate it from, which the degrees of freedom heed.
///
/// A mean over cases is of just these cases, not of others that might have been. Its sampling error is summed by
/// rounds, so that it does not take a disturbance that all cases of a round share for as many independent ones; the
/// shift between runs is taken to be one for all cases of a block; and from kSpread cases on the error is at least what
/// the scatter of the ratios themselves says.
///
/// Assumed, and not to be seen in two runs: that nothing but what is compared shifts all blocks together. For times
/// relative to the control case: what slows the device slows the control case by the same ratio.
class LogRatios {
 public:
  /// cases: of one device; each with at least one sample in either run
  explicit LogRatios(std::span<const RatioCase> cases);
  /// cases: indices; at least one
  [[nodiscard]] LogRatio of(std::span<const std::size_t> cases) const;
  /// Standard deviation, of a log, of what shifts a case between the runs.
  [[nodiscard]] double between_runs() const { return between_runs_; }

  static constexpr std::size_t kSpread = 5;

 private:
  /// One run's part in a case's ratio.
  struct Part {
    std::vector<double> errors;  ///< one a sample; they sum to the error of the location
    std::vector<int> rounds;
    int block = 0;
  };
  struct Entry {
    Part base;
    Part now;
    double mean = 0;
    double variance = 0;  ///< of sampling
    int df = 0;
    double shifts = 0;  ///< 1; 0 where both are the same measurement
  };
  [[nodiscard]] LogRatio of_one(const Entry& entry) const;
  void set_between_runs(std::span<const RatioCase> cases);

  std::vector<Entry> entries_;
  double between_runs_ = 0;
  double between_runs_df_ = 1;  ///< of its square
};

}  // namespace reliefbench
