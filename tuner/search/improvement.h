#pragma once
#include <cstddef>
#include <span>
#include <vector>

namespace reliefbench {

/// E max(best - T, 0) for a normal T.
[[nodiscard]] double expected_improvement(double best, double mean, double deviation);
/// No less than that, by a few multiplications.
[[nodiscard]] double most_improvement(double best, double mean, double deviation);

/// The least log time known within each budget, in strips: strip i holds the budgets of ranks [begin, begin of the
/// next). Ranks are those of the distinct errors of the feasible settings, so that a setting of rank r answers budgets
/// r, r + 1,
/// ... below `ranks`. Where nothing is known the log time is the reference point's.
class Staircase {
 public:
  Staircase(std::size_t ranks, double reference)
      : ranks_(ranks), reference_(reference), strips_{{.begin = 0, .log_time = reference}} {}

  /// Adds a point; one that some point as accurate dominates changes nothing.
  void add(std::size_t rank, double log_time);
  [[nodiscard]] double best(std::size_t rank) const;
  /// The area between the staircase and the reference, a rank being one wide.
  [[nodiscard]] double hypervolume() const;
  /// The expected growth of the hypervolume from a point of known rank and normal log time: closed form, the sum over
  /// the strips of width x expected improvement. Strips fall in time, so that it ends where none is left.
  /// source: Emmerich, Deutz & Klinkenberg, "Hypervolume-based expected improvement", 2011; one objective deterministic
  [[nodiscard]] double expected_growth(std::size_t rank, double mean, double deviation) const;
  /// No less than that.
  [[nodiscard]] double most_growth(std::size_t rank, double mean, double deviation) const {
    return static_cast<double>(ranks_ - rank) * most_improvement(best(rank), mean, deviation);
  }

 private:
  struct Strip {
    std::size_t begin;
    double log_time;
  };
  [[nodiscard]] std::size_t strip_of(std::size_t rank) const;
  [[nodiscard]] std::size_t end_of(std::size_t strip) const;

  std::size_t ranks_;
  double reference_;
  std::vector<Strip> strips_;  // by rising rank, falling time
};

/// Rank of each error among the distinct ones.
[[nodiscard]] std::vector<std::size_t> error_ranks(std::span<const double> errors);

}  // namespace reliefbench
