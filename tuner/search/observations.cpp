#include "tuner/search/observations.h"

#include <algorithm>
#include <cmath>

#include "kernels/base/error.h"
#include "tuner/search/loops.h"

namespace reliefbench {

static_assert(kBlock == 3, "the median statistic is that of triples");

namespace {

/// Of each frame, by rising time: the lesser of a pair is of one of the other blocks, the greater of another one.
void count_pairs(std::span<const std::size_t> blocks, std::size_t count, std::span<double> pairs) {
  std::vector<double> below(count, 0);  // frames, one a block
  double tied = 0;                      // pairs of a frame below and one above that are of one block
  const std::size_t n = blocks.size();
  for (std::size_t i = 0; i < n; ++i) {
    const double own_below = below[blocks[i]];
    const double own_above = kBlock - 1 - own_below;
    tied -= own_below;
    pairs[i] = (static_cast<double>(i) - own_below) * (static_cast<double>(n - 1 - i) - own_above) -
               (tied - own_below * own_above);
    tied += own_above;
    below[blocks[i]] += 1;
  }
}

}  // namespace

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
  pairs.resize(frames.size());
  count_pairs(blocks, medians.size(), pairs);
  plain = mean_median(frames, frames.front(), frames.back());
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
  const double sum = sum_of(static_cast<int>(observed.frames.size()), [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    return observed.pairs[at] * std::clamp(observed.frames[at], low, high);
  });
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

double mean_median(std::span<const double> values, double low, double high) {
  const int n = static_cast<int>(values.size());
  const double sum =
      sum_of(n, [&](int i) { return std::clamp(values[static_cast<std::size_t>(i)], low, high) * i * (n - 1 - i); });
  return sum / (n * (n - 1.0) * (n - 2.0) / 6);
}

double median_variance(std::span<const double> values, double low, double high) {
  const int n = static_cast<int>(values.size());
  const auto value = [&](int i) { return std::clamp(values[static_cast<std::size_t>(i)], low, high); };
  // As median_projection().
  const double mean = mean_median(values, low, high);
  const double share = 2 / ((n - 1.0) * (n - 2.0));
  double others = sum_of(n, [&](int i) { return value(i) * (n - 1 - i); }) - value(0) * (n - 1);
  double squares = 0;
  for (int i = 0;; ++i) {
    const double own = value(i) * i;
    const double deviation = (own * (n - 1 - i) + others) * share - mean;
    squares += deviation * deviation;
    if (i == n - 1) break;
    others += own - value(i + 1) * (n - 2 - i);
  }
  return squares * 9 / (n - 1);  // each value is one of three
}

}  // namespace reliefbench
