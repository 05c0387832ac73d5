#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <tuple>

#include "kernels/trace/technique.h"
#include "tuner/results/record.h"

namespace reliefbench {

/// How simple a setting is: fewer features (tuner/plan/features.h), then an earlier technique of the registry, which
/// goes from simple to involved. Smaller is simpler.
struct Simplicity {
  std::size_t features = 0;
  std::size_t technique = 0;
  // NOLINTNEXTLINE(modernize-use-nullptr): clang-tidy 14 takes the comparison with 0 inside for a pointer
  auto operator<=>(const Simplicity&) const = default;
};
[[nodiscard]] Simplicity simplicity(const Settings& settings);
/// Parameters that the record does not name, as those younger than it, have their default.
/// throws: Error(bad_input): a technique, parameter or value that this registry does not know
[[nodiscard]] Settings settings_of(const Record& record);
[[nodiscard]] Simplicity simplicity(const Record& record);  ///< of these settings

/// One of several settings that all do.
struct Contender {
  Simplicity simplicity{};
  std::int64_t memory_bytes = 0;  ///< of its map
  double low_ns = 0;              ///< confidence interval of its time
  double high_ns = 0;             ///< the time by which it is judged
  /// Order among settings whose times cannot be told apart: fewer features, less memory, the simpler technique, less
  /// time.
  [[nodiscard]] auto rank() const {
    return std::tuple(simplicity.features, memory_bytes, simplicity.technique, high_ns);
  }
};

struct Choice {
  std::size_t pick = 0;
  std::optional<std::size_t> tie{};  ///< the fastest of the others whose interval overlaps that of the fastest of all
  std::size_t ties = 0;              ///< how many these are
};
/// The one rule by which recommend, presets and tune pick: the least judged time leads, and of all whose interval
/// overlaps the leader's (shared ends count) the simplest and smallest is the pick.
/// contenders: not empty; of two that are equal in all, the first
[[nodiscard]] Choice choose(std::span<const Contender> contenders);

}  // namespace reliefbench
