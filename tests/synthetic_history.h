#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "tuner/decide/events.h"
#include "tuner/search/random.h"

namespace reliefbench {

/// Normal and Student's t numbers that do not differ between standard libraries.
class Noise {
 public:
  explicit Noise(std::uint64_t seed) : random_(seed) {}
  [[nodiscard]] double uniform() { return random_.uniform(); }
  [[nodiscard]] double normal();
  [[nodiscard]] double student3();  ///< of 3 degrees of freedom, its standard deviation 1

 private:
  Random random_;
};

/// The nights of one made-up series.
struct SyntheticHistory {
  std::size_t nights = 120;
  double sigma = 0.01;           ///< of a night's log value
  double autocorrelation = 0;    ///< of the noise, which then is AR(1)
  bool is_heavy_tailed = false;  ///< Student's t with 3 degrees of freedom
  double spike_share = 0;        ///< of nights that are 10 to 30 sigma slower
  std::size_t step_night = 0;    ///< first night of a new level
  double step = 0;               ///< in sigma
  double drift = 0;              ///< in sigma a night
};
[[nodiscard]] std::vector<double> synthetic_history(const SyntheticHistory& options, Noise& noise);

/// Series of machines, backends, techniques, maps and formats, all of these with all.
struct SyntheticFleet {
  std::uint64_t seed = 1;
  std::size_t machines = 1;
  std::size_t backends = 1;
  std::size_t techniques = 6;
  std::size_t maps = 3;
  std::size_t formats = 3;
  std::size_t nights = 40;
  double least_sigma = 0.01;  ///< of a night's log value; series differ in it
  double most_sigma = 0.03;
  double common_sigma = 0.003;  ///< of what all series of a machine share in a night
  double spike_share = 0.01;    ///< of nights that are 10 to 30 % slower
};
/// Named "t0", "m0", "f0", "b0" and so on. Machines take turns in the calendar.
[[nodiscard]] std::vector<CheckedSeries> synthetic_fleet(const SyntheticFleet& options);

}  // namespace reliefbench
