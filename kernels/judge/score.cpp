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
#include "kernels/base/prefetch.h"
#include "kernels/judge/metric_values.h"

namespace reliefbench {
namespace {

constexpr std::size_t kPixelsAtOnce = 1U << 13U;  // pixels that are judged while they are in the cache
constexpr double kRecoverableTexels = 0.5;        // nearer than this a hit is good, whatever came before

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
  // No branches, which random errors would make the processor mistake.
  constexpr std::array kOtherVerdicts{Verdict::inside, Verdict::unconverged, Verdict::good, Verdict::good};
  const bool is_before = t < reference.t_enter || pixel.status == static_cast<float>(PixelStatus::step_cap);
  return kOtherVerdicts[(e_xy <= kRecoverableTexels ? 2U : 0U) | (is_before ? 1U : 0U)];
}

}  // namespace

std::optional<PixelScore> score_passed(const ScorePixel& pixel, const ReferenceHit& reference) {
  const bool passed = pixel.status == static_cast<float>(PixelStatus::passed);
  if (reference.passes())
    return PixelScore{.e_xy = 0, .e_z = 0, .verdict = passed ? Verdict::passed : Verdict::false_keep};
  if (passed) return PixelScore{.e_xy = 0, .e_z = 0, .verdict = Verdict::false_kill};
  return std::nullopt;
}

PixelScore score_pixel(const ScorePixel& pixel, const ReferenceHit& reference, double e_xy) {
  if (!std::isfinite(pixel.t) || !std::isfinite(e_xy))
    return {.e_xy = std::numeric_limits<float>::max(), .e_z = 1, .verdict = Verdict::missed};
  const double e_z = std::abs(static_cast<double>(pixel.t) - reference.t_enter);
  return {.e_xy = to_float(e_xy), .e_z = to_float(e_z), .verdict = verdict_of(pixel, reference, e_xy)};
}

namespace {

PixelScore score_ray(const ScorePixel& pixel, const ReferenceHit& reference, double map_width, double map_height) {
  if (!has_ray(pixel)) return {};
  // Squares of floats neither overflow a double nor vanish in it.
  const double travel_u = static_cast<double>(pixel.ray.slope_u) * map_width;
  const double travel_v = static_cast<double>(pixel.ray.slope_v) * map_height;
  const double travel_texels = std::sqrt(travel_u * travel_u + travel_v * travel_v);
  if (const auto passed = score_passed(pixel, reference)) return *passed;
  if (!std::isfinite(pixel.t)) return {.e_xy = to_float(travel_texels), .e_z = 1, .verdict = Verdict::missed};
  return score_pixel(pixel, reference, std::abs(static_cast<double>(pixel.t) - reference.t_enter) * travel_texels);
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

/// Of pixels' verdicts: how many there are of each, and who has a ray.
VerdictCounts verdicts_of(std::span<const PixelScore> scores, std::span<std::uint8_t> has_ray) {
  std::array<VerdictCounts, 4> parts{};  // an addition need not wait for the one before, which is of the same verdict
  for (std::size_t i = 0; i < scores.size(); ++i) {
    ++parts[i % parts.size()].counts[static_cast<std::size_t>(scores[i].verdict)];
    has_ray[i] = is_judged(scores[i]) ? 1 : 0;
  }
  return std::accumulate(parts.begin(), parts.end(), VerdictCounts{},
                         [](VerdictCounts sum, const VerdictCounts& part) { return sum += part; });
}

/// The shares of pixels with a verdict, of one feature, or of hits ("").
void judge_verdicts(std::string_view feature, const VerdictCounts& verdicts, FrameScore& score) {
  const std::int64_t pixels = verdicts.of(feature.empty() ? OfVerdict(has_hits) : OfVerdict(is_judged));
  each_metric<OfVerdict>(score, [&](const Metric& metric, OfVerdict is_one, const auto& numbers) {
    if (metric.feature != feature) return;
    numbers.front() = pixels == 0 ? 0 : static_cast<double>(verdicts.of(is_one)) / static_cast<double>(pixels);
  });
}

void score_rays(std::span<const ScorePixel> pixels, std::span<const ReferenceHit> reference, double map_width,
                double map_height, std::span<PixelScore> scores) {
  for (std::size_t i = 0; i < scores.size(); ++i) {
    prefetch(&pixels[i], kBytesAhead);
    prefetch(&reference[i], kBytesAhead);
    const PixelScore score = score_ray(pixels[i], reference[i], map_width, map_height);
    // Part by part: a whole that was just put together from parts is slow to read.
    scores[i].e_xy = score.e_xy;
    scores[i].e_z = score.e_z;
    scores[i].verdict = score.verdict;
  }
}

/// All that is judged of a block of pixels is judged while it is in the processor's cache.
/// score(first, scores): fills in the scores of pixels from the first on
template <typename Score>
JudgedFrame judge_blocks(std::span<const ScorePixel> pixels, PixelScores judged, std::string_view passing,
                         const Score& score) {
  JudgedFrame frame{.score = {}, .pixels = std::move(judged), .mask = {}};
  frame.mask.has_ray.resize(pixels.size());
  std::vector<MetricValues> values;
  each_metric<OfPixels>(
      frame.score, [&](const Metric& metric, OfPixels, const auto&) { values.emplace_back(metric, pixels.size()); });
  const VerdictCounts verdicts =
      sum_of_shares(pixels.size(), [&](std::size_t share, std::size_t begin, std::size_t size) {
        for (MetricValues& one : values) one.reserve(share, size);
        VerdictCounts of_share;
        for (std::size_t first = begin; first < begin + size; first += kPixelsAtOnce) {
          const std::size_t count = std::min(kPixelsAtOnce, begin + size - first);
          const std::span<PixelScore> scores = std::span(frame.pixels).subspan(first, count);
          score(first, scores);
          of_share += verdicts_of(scores, std::span(frame.mask.has_ray).subspan(first, count));
          auto into = values.begin();
          each_metric<OfPixels>(frame.score, [&](const Metric&, OfPixels function, const auto&) {
            (into++)->append(share, [&](UnfilledVector<float>& list) {
              function({.traced = pixels.subspan(first, count), .scores = scores}, list);
            });
          });
        }
        for (MetricValues& one : values) one.finish(share);
        return of_share;
      });
  frame.mask.count = verdicts.of(is_judged);
  frame.score.pixels = verdicts.of(is_judged);
  auto from = values.begin();
  each_metric<OfPixels>(frame.score, [&](const Metric&, OfPixels, const auto& numbers) {
    std::ranges::fill(numbers, 0);
    (from++)->put(numbers);
  });
  judge_verdicts("", verdicts, frame.score);
  if (!passing.empty()) judge_verdicts(passing, verdicts, frame.score);
  return frame;
}

}  // namespace

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

PixelScores judge_pixels(std::span<const ScorePixel> pixels, std::span<const ReferenceHit> reference, int map_width,
                         int map_height) {
  assert(pixels.size() == reference.size());
  PixelScores scores(pixels.size());
  for_each_share(pixels.size(), [&](std::size_t, std::size_t first, std::size_t count) {
    score_rays(pixels.subspan(first, count), reference.subspan(first, count), map_width, map_height,
               std::span(scores).subspan(first, count));
  });
  return scores;
}

JudgedFrame judge(std::span<const ScorePixel> pixels, std::span<const ReferenceHit> reference, int map_width,
                  int map_height, bool is_solid) {
  assert(pixels.size() == reference.size());
  const auto score = [&](std::size_t first, std::span<PixelScore> scores) {
    score_rays(pixels.subspan(first, scores.size()), reference.subspan(first, scores.size()), map_width, map_height,
               scores);
  };
  return judge_blocks(pixels, PixelScores(pixels.size()), is_solid ? kOfSolid : "", score);
}

JudgedFrame judge(std::span<const ScorePixel> pixels, PixelScores judged, std::string_view passing) {
  return judge_blocks(pixels, std::move(judged), passing, [](std::size_t, std::span<PixelScore>) {});
}

void judge_feature(std::string_view feature, std::span<const float> found, std::span<const float> exact,
                   std::span<const PixelScore> mask, FrameScore& score) {
  assert(found.size() == mask.size() && exact.size() == mask.size());
  each_metric<OfFeature>(score, [&](const Metric& metric, OfFeature function, const auto& numbers) {
    if (metric.feature != feature) return;
    std::ranges::fill(numbers, 0);
    if (score.pixels == 0) return;
    MetricValues values(metric, mask.size());
    for_each_share(mask.size(), [&](std::size_t at, std::size_t first, std::size_t count) {
      values.append(at, [&](UnfilledVector<float>& into) {
        into.reserve(count);
        for (std::size_t i = first; i < first + count; ++i)
          if (has_hits(mask[i])) into.push_back(function(found[i], exact[i]));
      });
      values.finish(at);
    });
    values.put(numbers);
  });
}

void judge_pictures(const PicturePair& pictures, const RayMask& mask, FrameScore& score) {
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
