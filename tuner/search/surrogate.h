#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "tuner/search/likelihood.h"
#include "tuner/search/space.h"

namespace reliefbench {

/// A Gaussian process on log time over the settings of a space: Matern 5/2 with a length for each axis (automatic
/// relevance determination) on log1p of step counts and of work, Hamming distance on categories. Step counts are caps,
/// work is what the rays did, so that the prior's mean is a fixed cost and a cost of each unit of the first work axis,
/// fitted once, to the first points, by least squares in log time: later ones lie near the front, where what is fast
/// for its work would pass for what work costs. Without such an axis it is constant. A count of steps is also a choice:
/// what 16 steps cost need not lie between what 8 and 32 do, as compilers unroll some loops. Where an axis is inactive
/// in one of two settings it adds a constant, less than a full difference: a step count that a technique does not have
/// is not zero steps of it, and which axes are active follows from few others. (A step count of 0 is taken for
/// inactive.) A choice that no point had at the last fit adds a distance that the fit cannot explain away: of an axis
/// whose points all agree it learns nothing. A share of the variance is additive, the mean over the axes of one
/// rational quadratic kernel each, so that what an axis does in one technique is expected in another. Adding a point
/// costs O(points x settings): the Cholesky factor and, with it, the factor's columns for all settings grow by a row.
/// Hyper-parameters maximise the posterior density and are refitted when the points are 1.2 times as many. The
/// constants were chosen on parts of the recorded sweeps (tests/data). source: Rasmussen & Williams, "Gaussian
/// Processes for Machine Learning", 2006, sections 2.2, 5.4.1
class Surrogate {
 public:
  enum class Axis { steps, work, category, count };

  /// capacity: most points at once
  Surrogate(const SearchSpace& space, std::size_t capacity);

  /// Adds a point, the setting's log time and the variance of its noise. A setting is added once.
  void add(std::size_t candidate, double log_time, double noise_variance);
  void set(std::size_t point, double log_time) { values_[static_cast<Eigen::Index>(point)] = log_time; }
  /// Takes the last points away again.
  void shrink(std::size_t points);
  /// Fits the hyper-parameters if there are 1.2 times the points of the last time.
  void fit_if_due();
  /// Brings mean() up to date with the points; deviation() always is.
  void update();

  [[nodiscard]] std::size_t size() const { return points_.size(); }
  [[nodiscard]] std::size_t capacity() const { return capacity_; }
  [[nodiscard]] double mean(std::size_t candidate) const { return mean_[static_cast<Eigen::Index>(candidate)]; }
  [[nodiscard]] double deviation(std::size_t candidate) const;  ///< of the noiseless log time

 private:
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  [[nodiscard]] Eigen::ArrayXd along(std::size_t axis, std::size_t own) const;  // one a value of the axis
  [[nodiscard]] Eigen::VectorXd correlations(std::size_t candidate) const;      // with all settings
  [[nodiscard]] Likelihood::Points pairs_of(std::span<const std::size_t> points) const;
  void fit();
  void append(std::size_t candidate, double noise_variance);
  void find_unseen();
  void fit_prior();
  [[nodiscard]] double above_prior(std::size_t point) const;
  void rebuild();

  /// The distinct values of an axis: what depends on one of them is worked out once for all settings that have it.
  struct Levels {
    Axis axis;
    std::vector<double> values;
    std::vector<double> unseen;       // squared distance that is added, see kUnseen; one a value
    std::vector<std::size_t> places;  // in values, one a setting
    [[nodiscard]] double operator[](std::size_t candidate) const { return values[places[candidate]]; }
  };
  void add_axis(Axis axis, std::vector<double> features);

  /// Axes whose values many settings share: what depends on these alone is worked out once for all that do.
  struct Group {
    std::vector<std::size_t> axes;
    std::vector<std::size_t> examples;  // a setting of each tuple of values
    std::vector<std::size_t> places;    // in examples, one a setting
  };
  void add_group(std::vector<std::size_t> axes);

  std::size_t capacity_;
  std::vector<Levels> axes_;
  std::vector<Group> groups_;
  Eigen::VectorXd work_;      // of each setting, on the first work axis; 0 without one
  Eigen::VectorXd prior_;     // log time of each setting: the process's mean
  Eigen::VectorXd weights_;   // 1 / length^2 of each axis
  double variance_ = 1;       // of the process
  std::size_t next_fit_ = 6;  // points
  bool has_prior_ = false;    // fitted
  std::vector<std::size_t> points_;
  std::vector<double> noise_;
  Eigen::VectorXd values_;     // log time of the points
  RowMajor factor_;            // Cholesky, of the points' covariance
  RowMajor columns_;           // factor^-1 x covariance of points and settings
  Eigen::VectorXd explained_;  // variance, of each setting
  Eigen::VectorXd mean_;
};

}  // namespace reliefbench
