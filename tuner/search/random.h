#pragma once
#include <cstdint>

namespace reliefbench {

/// SplitMix64's finaliser: every bit of the input reaches every bit of the output. A random number as a function of a
/// counter, the same on every machine.
[[nodiscard]] constexpr std::uint64_t mixed(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15U;
  x = (x ^ (x >> 30U)) * 0xbf58476d1ce4e5b9U;
  x = (x ^ (x >> 27U)) * 0x94d049bb133111ebU;
  return x ^ (x >> 31U);
}

/// Random numbers by counting; the same on every standard library.
class Random {
 public:
  explicit Random(std::uint64_t seed) : seed_(mixed(seed)) {}
  [[nodiscard]] std::uint64_t bits() { return mixed(seed_ ^ count_++); }
  [[nodiscard]] std::uint64_t below(std::uint64_t n) { return ((bits() >> 32U) * n) >> 32U; }  ///< n < 2^32
  [[nodiscard]] double uniform() { return static_cast<double>(bits() >> 11U) * 0x1p-53; }      ///< in [0, 1)

 private:
  std::uint64_t seed_;
  std::uint64_t count_ = 0;
};

}  // namespace reliefbench
