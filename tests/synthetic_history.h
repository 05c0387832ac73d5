#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

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

}  // namespace reliefbench
