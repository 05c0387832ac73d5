#include "tuner/search/observations.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "kernels/base/error.h"

namespace reliefbench {

static_assert(kBlock == 3, "the median statistic is that of triples");

void Observed::add(const std::array<double, kBlock>& block) {
  const std::size_t number = medians.size();
  for (const double frame : block) {
    const auto at = std::ranges::upper_bound(frames, frame);
    blocks.insert(blocks.begin() + (at - frames.begin()), number);
    frames.insert(at, frame);
  }
  std::array<double, kBlock> sorted = block;
  std::ranges::sort(sorted);
  medians.insert(std::ranges::upper_bound(medians, sorted[1]), sorted[1]);
  fastest.insert(std::ranges::upper_bound(fastest, sorted[0]), sorted[0]);
  plain = median_statistic(frames);
  if (medians.size() >= 3) across = median_across_blocks(*this, frames.front(), frames.back());
}

void draw_round(TimeSource& times, std::span<const std::size_t> candidates, std::span<Observed> observed) {
  std::vector<FrameOf> round;
  for (int i = 0; i < kBlock; ++i)
    for (const std::size_t candidate : candidates)
      round.push_back({.candidate = candidate, .index = static_cast<int>(observed[candidate].frames.size()) + i});
  times.will_ask(round);
  std::vector<std::array<double, kBlock>> blocks(candidates.size());
  for (std::size_t i = 0; i < round.size(); ++i) {
    const double time_ns = times.frame_ns(round[i].candidate, round[i].index);
    if (!(time_ns > 0) || std::isinf(time_ns))
      fail_input("sample {} of setting {} took {} ns: not a time", round[i].index, round[i].candidate, time_ns);
    blocks[i % candidates.size()][i / candidates.size()] = std::log(time_ns);
  }
  for (std::size_t i = 0; i < candidates.size(); ++i) observed[candidates[i]].add(blocks[i]);
}

double median_across_blocks(const Observed& observed, double low, double high) {
  const std::size_t n = observed.frames.size();
  std::vector<double> below(observed.medians.size(), 0);  // frames, one a block
  std::vector<double> above(observed.medians.size(), kBlock);
  double tied = 0;  // pairs of a frame below and one above that are of one block
  double sum = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t own = observed.blocks[i];
    above[own] -= 1;
    tied -= below[own];
    const double pairs = (static_cast<double>(i) - below[own]) * (static_cast<double>(n - 1 - i) - above[own]) -
                         (tied - below[own] * above[own]);
    sum += pairs * std::clamp(observed.frames[i], low, high);
    tied += above[own];
    below[own] += 1;
  }
  const double k = observed.count();
  return sum / (k * (k - 1) * (k - 2) / 6 * kBlock * kBlock * kBlock);
}

double lesser_across_blocks(const Observed& observed, double low, double high) {
  std::array<double, 2> above{kBlock, kBlock};
  double sum = 0;
  for (std::size_t i = 0; i < observed.frames.size(); ++i) {
    const std::size_t own = observed.blocks[i];
    above[own] -= 1;
    sum += above[1 - own] * std::clamp(observed.frames[i], low, high);
  }
  return sum / (kBlock * kBlock);
}

double greater_across_blocks(const Observed& observed, double low, double high) {
  std::array<double, 2> below{};
  double sum = 0;
  for (std::size_t i = 0; i < observed.frames.size(); ++i) {
    const std::size_t own = observed.blocks[i];
    sum += below[1 - own] * std::clamp(observed.frames[i], low, high);
    below[own] += 1;
  }
  return sum / (kBlock * kBlock);
}

std::vector<double> median_projection(std::span<const double> values) {
  const std::size_t n = values.size();
  const auto count = [](std::size_t i) { return static_cast<double>(i); };
  // Partners both larger: the smaller of them is the median; both smaller: the larger; one of each: the value itself.
  double above = 0;
  for (std::size_t i = 0; i < n; ++i) above += values[i] * count(n - 1 - i);
  double below = 0;
  std::vector<double> projection;
  projection.reserve(n);
  const double pairs = count(n - 1) * count(n - 2) / 2;
  for (std::size_t i = 0; i < n; ++i) {
    above -= values[i] * count(n - 1 - i);
    projection.push_back((values[i] * count(i) * count(n - 1 - i) + below + above) / pairs);
    below += values[i] * count(i);
  }
  return projection;
}

MedianStatistic median_statistic(std::span<const double> values) {
  const std::vector<double> projection = median_projection(values);
  const auto n = static_cast<double>(values.size());
  MedianStatistic result{.mean = std::accumulate(projection.begin(), projection.end(), 0.0) / n};
  for (const double value : projection) result.variance += (value - result.mean) * (value - result.mean);
  result.variance *= 9 / (n - 1);  // each value is one of three
  return result;
}

}  // namespace reliefbench
