#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>

namespace reliefbench {

/// What a setting loses, as the worst or the mean over several places of which one is searched in: `error` is what it
/// is known to lose in the others, infinite where it will not do; its time there, over the fastest's, is the ratio.
struct RegretRule {
  bool is_worst = true;
  double own_share = 0.5;  ///< weight of the place that is searched in, for the mean; in (0, 1]

  /// ratio: 1 or more. Rises in both
  [[nodiscard]] double regret(double error, double ratio) const {
    return is_worst ? std::max(error, ratio - 1) : (1 - own_share) * error + own_share * (ratio - 1);
  }
  /// The greatest ratio of which a setting's regret is no more than `regret`; under 1 where there is none.
  [[nodiscard]] double most_ratio(double error, double regret) const {
    if (is_worst) return error <= regret ? 1 + regret : 0;
    return std::isinf(error) ? 0 : 1 + (regret - (1 - own_share) * error) / own_share;
  }
};

}  // namespace reliefbench
