#include "kernels/judge/score.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <numeric>
#include <utility>

#include "kernels/base/parallel.h"

namespace reliefbench {
namespace {

constexpr double kRecoverableTexels = 0.5;  // nearer than this a hit is good, whatever came before

bool has_ray(const ScorePixel& pixel) {
  // Nothing times 0 is 0 but a finite number.
  const float zero = pixel.ray.u * 0 + pixel.ray.v * 0 + pixel.ray.slope_u * 0 + pixel.ray.slope_v * 0;
  return pixel.status != static_cast<float>(PixelStatus::no_ray) && zero == 0;
}

float to_float(double error) {
  return static_cast<float>(std::min(error, static_cast<double>(std::numeric_limits<float>::max())));
}

Verdict verdict_of(const ScorePixel& pixel, const ReferenceHit& reference, double e_xy) {
  const double t = pixel.t;
  // The found t is a float: the two around t_enter are as good as it can be, even where the ray only touches.
  if (t >= reference.t_exit && pixel.t > std::nextafter(static_cast<float>(reference.t_enter), 2.0F))
    return Verdict::missed;
  if (e_xy <= kRecoverableTexels) return Verdict::good;
  if (t < reference.t_enter || pixel.status == static_cast<float>(PixelStatus::step_cap)) return Verdict::unconverged;
  return Verdict::inside;
}

/// Whether it passed, in truth and as it was found; none: neither.
inline std::optional<PixelScore> scored_passing(const ScorePixel& pixel, const ReferenceHit& reference) {
  const bool passed = pixel.status == static_cast<float>(PixelStatus::passed);
  if (reference.passes()) return PixelScore{.verdict = passed ? Verdict::passed : Verdict::false_keep};
  if (passed) return PixelScore{.verdict = Verdict::false_kill};
  return std::nullopt;
}

inline PixelScore scored(const ScorePixel& pixel, const ReferenceHit& reference, double e_xy) {
  if (!std::isfinite(pixel.t) || !std::isfinite(e_xy))
    return {.e_xy = std::numeric_limits<float>::max(), .e_z = 1, .verdict = Verdict::missed};
  const double e_z = std::abs(static_cast<double>(pixel.t) - reference.t_enter);
  return {.e_xy = to_float(e_xy), .e_z = to_float(e_z), .verdict = verdict_of(pixel, reference, e_xy)};
}

PixelScore score_ray(const ScorePixel& pixel, const ReferenceHit& reference, int map_width, int map_height) {
  if (!has_ray(pixel)) return {};
  // Squares of floats neither overflow a double nor vanish in it.
  const double travel_u = static_cast<double>(pixel.ray.slope_u) * map_width;
  const double travel_v = static_cast<double>(pixel.ray.slope_v) * map_height;
  const double travel_texels = std::sqrt(travel_u * travel_u + travel_v * travel_v);
  if (const auto passed = scored_passing(pixel, reference)) return *passed;
  if (!std::isfinite(pixel.t)) return {.e_xy = to_float(travel_texels), .e_z = 1, .verdict = Verdict::missed};
  return scored(pixel, reference, std::abs(static_cast<double>(pixel.t) - reference.t_enter) * travel_texels);
}

/// Sums in eight lanes: one addition need not wait for the one before.
double sum_of(std::span<const float> values) {
  std::array<double, 8> lanes{};
  std::size_t i = 0;
  for (; i + lanes.size() <= values.size(); i += lanes.size())
    for (std::size_t lane = 0; lane < lanes.size(); ++lane) lanes[lane] += static_cast<double>(values[i + lane]);
  for (; i < values.size(); ++i) lanes[0] += static_cast<double>(values[i]);
  return std::accumulate(lanes.begin(), lanes.end(), 0.0);
}

/// The values of a metric, one a judged pixel, in shares that threads fill.
class MetricValues {
 public:
  /// append(first, count, values): those of `count` pixels from the first on
  template <typename Append>
  MetricValues(std::size_t pixels, const Append& append) : shares_(share_count(pixels)) {
    for_each_share(pixels, [&](std::size_t at, std::size_t first, std::size_t count) {
      Share& share = shares_[at];
      append(first, count, share.values);
      share.sum = sum_of(share.values);
      for (const float value : share.values) share.max = std::max(share.max, value);
    });
    for (const Share& share : shares_) {
      sum_ += share.sum;
      max_ = std::max(max_, share.max);
      count_ += share.values.size();
    }
  }

  [[nodiscard]] bool is_empty() const { return count_ == 0; }
  [[nodiscard]] double mean() const { return sum_ / static_cast<double>(count_); }
  [[nodiscard]] double max() const { return static_cast<double>(max_); }
  /// By nearest rank: the smallest value that at least `percent` of all do not exceed.
  [[nodiscard]] double percentile(double percent) {
    if (histogram_.empty()) count_bins();
    auto rank = static_cast<std::int64_t>(std::ceil(percent * static_cast<double>(count_) / 100)) - 1;
    std::size_t bin = 0;
    for (; rank >= histogram_[bin]; ++bin) rank -= histogram_[bin];
    std::vector<float> same = values_of(bin);
    std::ranges::nth_element(same, same.begin() + rank);
    return static_cast<double>(same[static_cast<std::size_t>(rank)]);
  }

 private:
  /// Values are not negative, so that their bits lie as they do. A bin is an exponent and three bits of the mantissa.
  static constexpr int kBinShift = 20;
  static constexpr std::size_t kBins = 1U << (31 - kBinShift);
  static std::size_t bin_of(float value) { return std::bit_cast<std::uint32_t>(value) >> kBinShift; }

  struct Share {
    std::vector<float> values;
    double sum = 0;
    float max = 0;
    std::vector<std::int64_t> counts;  // a bin
  };

  template <typename Work>
  void each_share(const Work& work) {
    parallel_for(static_cast<int>(shares_.size()), 0, [&](int at) { work(static_cast<std::size_t>(at)); });
  }

  void count_bins() {
    each_share([&](std::size_t at) {
      Share& share = shares_[at];
      share.counts.assign(kBins, 0);
      for (const float value : share.values) ++share.counts[bin_of(value)];
    });
    histogram_.assign(kBins, 0);
    for (const Share& share : shares_)
      std::ranges::transform(histogram_, share.counts, histogram_.begin(), std::plus());
  }

  std::vector<float> values_of(std::size_t bin) {
    std::vector<std::int64_t> begins;
    begins.reserve(shares_.size());
    std::int64_t count = 0;
    for (const Share& share : shares_) {
      begins.push_back(count);
      count += share.counts[bin];
    }
    std::vector<float> found(static_cast<std::size_t>(count));
    each_share([&](std::size_t at) {
      std::ranges::copy_if(shares_[at].values, found.begin() + begins[at],
                           [&](float value) { return bin_of(value) == bin; });
    });
    return found;
  }

  std::vector<Share> shares_;
  double sum_ = 0;
  float max_ = 0;
  std::size_t count_ = 0;
  std::vector<std::int64_t> histogram_;
};

double number_of(MetricValues& values, Aggregate aggregate) {
  switch (aggregate) {
    case Aggregate::mean:
      return values.mean();
    case Aggregate::p50:
      return values.percentile(50);
    case Aggregate::p95:
      return values.percentile(95);
    case Aggregate::p99:
      return values.percentile(99);
    case Aggregate::max:
      return values.max();
  }
  return 0;
}

/// Calls use(function, numbers) for the metrics whose function is of one kind.
template <typename Function, typename Use>
void each_metric(FrameScore& score, const Use& use) {
  std::size_t place = 0;
  for (const Metric& metric : kMetrics) {
    const std::span numbers = std::span(score.values).subspan(place, metric.aggregates.size());
    place += metric.aggregates.size();
    if (const auto* function = std::get_if<Function>(&metric.function)) use(metric, *function, numbers);
  }
}

/// How many pixels have each verdict.
struct VerdictCounts {
  std::array<std::int64_t, kVerdicts> counts{};

  VerdictCounts& operator+=(const VerdictCounts& other) {
    std::ranges::transform(counts, other.counts, counts.begin(), std::plus());
    return *this;
  }
  [[nodiscard]] std::int64_t of(OfVerdict is_one) const {
    std::int64_t sum = 0;
    for (std::size_t i = 0; i < counts.size(); ++i) sum += is_one(static_cast<Verdict>(i)) ? counts.at(i) : 0;
    return sum;
  }
};

VerdictCounts verdicts_of(std::span<const PixelScore> scores) {
  return sum_of_shares(scores.size(), [&](std::size_t first, std::size_t size) {
    std::array<VerdictCounts, 4> parts{};  // an addition need not wait for the one before, which is of the same verdict
    for (std::size_t i = 0; i < size; ++i)
      ++parts[i % parts.size()].counts[static_cast<std::size_t>(scores[first + i].verdict)];
    return std::accumulate(parts.begin(), parts.end(), VerdictCounts{},
                           [](VerdictCounts sum, const VerdictCounts& part) { return sum += part; });
  });
}

/// The shares of pixels with a verdict, of one feature, or of hits ("").
void judge_verdicts(std::string_view feature, const VerdictCounts& verdicts, FrameScore& score) {
  const std::int64_t pixels = verdicts.of(feature.empty() ? OfVerdict(has_hits) : OfVerdict(is_judged));
  each_metric<OfVerdict>(score, [&](const Metric& metric, OfVerdict is_one, const auto& numbers) {
    if (metric.feature != feature) return;
    numbers.front() = pixels == 0 ? 0 : static_cast<double>(verdicts.of(is_one)) / static_cast<double>(pixels);
  });
}

}  // namespace

PixelScore score_pixel(const ScorePixel& pixel, const ReferenceHit& reference, double e_xy) {
  return scored(pixel, reference, e_xy);
}

std::optional<PixelScore> score_passed(const ScorePixel& pixel, const ReferenceHit& reference) {
  return scored_passing(pixel, reference);
}

std::int64_t judged_count(std::span<const PixelScore> scores) { return verdicts_of(scores).of(is_judged); }

std::vector<TextureRay> rays_of(std::span<const ScorePixel> pixels) {
  std::vector<TextureRay> rays(pixels.size());
  for_each_share(pixels.size(), [&](std::size_t, std::size_t first, std::size_t size) {
    std::ranges::transform(pixels.subspan(first, size), rays.begin() + static_cast<std::ptrdiff_t>(first),
                           &ScorePixel::ray);
  });
  return rays;
}

bool have_rays(std::span<const ScorePixel> pixels, std::span<const TextureRay> rays) {
  using Bits = std::array<std::uint32_t, 4>;
  if (pixels.size() != rays.size()) return false;
  return 0 == sum_of_shares(pixels.size(), [&](std::size_t first, std::size_t size) {
           std::int64_t others = 0;
           for (std::size_t i = first; i < first + size; ++i)
             others += std::bit_cast<Bits>(pixels[i].ray) == std::bit_cast<Bits>(rays[i]) ? 0 : 1;
           return others;
         });
}

std::vector<ReferenceHit> exact_hits(const ReferenceTracer& tracer, std::span<const ScorePixel> pixels) {
  std::vector<TextureRay> rays;
  std::vector<std::size_t> where;
  rays.reserve(pixels.size());
  where.reserve(pixels.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (pixels[i].status == static_cast<float>(PixelStatus::no_ray)) continue;
    rays.push_back(pixels[i].ray);
    where.push_back(i);
  }
  const std::vector<ReferenceHit> traced = tracer.trace(rays);
  std::vector<ReferenceHit> hits(pixels.size());
  for (std::size_t i = 0; i < traced.size(); ++i) hits[where[i]] = traced[i];
  return hits;
}

std::vector<PixelScore> judge_pixels(std::span<const ScorePixel> pixels, std::span<const ReferenceHit> reference,
                                     int map_width, int map_height) {
  assert(pixels.size() == reference.size());
  std::vector<PixelScore> scores(pixels.size());
  for_each_share(pixels.size(), [&](std::size_t, std::size_t first, std::size_t count) {
    for (std::size_t i = first; i < first + count; ++i)
      scores[i] = score_ray(pixels[i], reference[i], map_width, map_height);
  });
  return scores;
}

JudgedFrame judge(std::span<const ScorePixel> pixels, std::span<const ReferenceHit> reference, int map_width,
                  int map_height, bool is_solid) {
  return judge(pixels, judge_pixels(pixels, reference, map_width, map_height), is_solid ? kOfSolid : "");
}

JudgedFrame judge(std::span<const ScorePixel> pixels, std::vector<PixelScore> judged, std::string_view passing) {
  JudgedFrame frame{.score = {}, .pixels = std::move(judged)};
  const VerdictCounts verdicts = verdicts_of(frame.pixels);
  frame.score.pixels = verdicts.of(is_judged);
  each_metric<OfPixels>(frame.score, [&](const Metric& metric, OfPixels function, const auto& numbers) {
    std::ranges::fill(numbers, 0);
    if (frame.score.pixels == 0) return;
    const std::span<const PixelScore> scores = frame.pixels;
    MetricValues values(pixels.size(), [&](std::size_t first, std::size_t count, std::vector<float>& into) {
      function({.traced = pixels.subspan(first, count), .scores = scores.subspan(first, count)}, into);
    });
    if (values.is_empty()) return;
    std::ranges::transform(metric.aggregates, numbers.begin(), [&](Aggregate part) { return number_of(values, part); });
  });
  judge_verdicts("", verdicts, frame.score);
  if (!passing.empty()) judge_verdicts(passing, verdicts, frame.score);
  return frame;
}

void judge_feature(std::string_view feature, std::span<const float> found, std::span<const float> exact,
                   std::span<const PixelScore> mask, FrameScore& score) {
  assert(found.size() == mask.size() && exact.size() == mask.size());
  each_metric<OfFeature>(score, [&](const Metric& metric, OfFeature function, const auto& numbers) {
    if (metric.feature != feature) return;
    std::ranges::fill(numbers, 0);
    if (score.pixels == 0) return;
    MetricValues values(mask.size(), [&](std::size_t first, std::size_t count, std::vector<float>& into) {
      into.reserve(count);
      for (std::size_t i = first; i < first + count; ++i)
        if (has_hits(mask[i])) into.push_back(function(found[i], exact[i]));
    });
    std::ranges::transform(metric.aggregates, numbers.begin(), [&](Aggregate part) { return number_of(values, part); });
  });
}

void judge_pictures(const PicturePair& pictures, std::span<const PixelScore> mask, FrameScore& score) {
  each_metric<OfPictures>(score, [&](const Metric&, OfPictures function, const auto& numbers) {
    numbers.front() = function(pictures, mask);
  });
}

void MotionJudge::add(const FlickerFrame& before, const FlickerFrame& now) {
  for (std::size_t i = 0; i < kMetrics.size(); ++i) {
    const auto* function = std::get_if<OfMotion>(&kMetrics.at(i).function);
    if (function == nullptr) continue;
    const std::optional<double> value = (*function)(before, now);
    sums_.at(i).sum += value.value_or(0);
    sums_.at(i).count += value ? 1 : 0;
  }
}

void MotionJudge::fill_in(FrameScore& score) const {
  each_metric<OfMotion>(score, [&](const Metric& metric, OfMotion, const auto& numbers) {
    const Sum& total = sums_.at(static_cast<std::size_t>(&metric - kMetrics.data()));
    if (total.count > 0) numbers.front() = total.sum / total.count;
  });
}

}  // namespace reliefbench
