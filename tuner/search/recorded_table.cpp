#include "tuner/search/recorded_table.h"

namespace reliefbench {
namespace {

/// SplitMix64's finaliser: every bit of the input reaches every bit of the output.
std::uint64_t mixed(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15U;
  x = (x ^ (x >> 30U)) * 0xbf58476d1ce4e5b9U;
  x = (x ^ (x >> 27U)) * 0x94d049bb133111ebU;
  return x ^ (x >> 31U);
}

}  // namespace

double ReplaySource::frame_ns(std::size_t candidate, int index) {
  const std::vector<double>& samples = table_.samples.at(candidate);
  const std::uint64_t draw = mixed(mixed(mixed(seed_) ^ candidate) ^ static_cast<std::uint64_t>(index));
  return samples[draw % samples.size()];
}

}  // namespace reliefbench
