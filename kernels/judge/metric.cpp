#include "kernels/judge/metric.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstring>
#include <string>

#include "kernels/base/error.h"
#include "kernels/base/parallel.h"
#include "kernels/base/suggest.h"
#include "kernels/judge/depth_range.h"

namespace reliefbench {
namespace {

constexpr float kHalfLit = 0.5F;
constexpr std::size_t kMostSquares = 1U << 10U;  // of pixels, whose sum a number of 32 bits holds, in the cache

bool takes_hits(const PixelScore& score) { return has_hits(score); }
bool takes_rays(const PixelScore& score) { return is_judged(score); }

/// takes: which pixels count
template <typename Value, typename Takes>
void append(const JudgedPixels& pixels, UnfilledVector<float>& values, const Takes& takes, const Value& value) {
  std::size_t size = values.size();
  values.resize(size + pixels.scores.size());
  // Every value is written and those without a ray are overwritten: no branch that is as often mistaken as foreseen.
  for (std::size_t i = 0; i < pixels.scores.size(); ++i) {
    values[size] = value(pixels.traced[i], pixels.scores[i]);
    size += takes(pixels.scores[i]) ? 1 : 0;
  }
  values.resize(size);
}

/// Of pixels: how many show another object than the relief, how many of those with a ray the wrong object.
struct Seen {
  std::int64_t objects = 0;
  std::int64_t wrong = 0;

  Seen& operator+=(const Seen& other) {
    objects += other.objects;
    wrong += other.wrong;
    return *this;
  }
};

/// An RGBA8 pixel, red lowest.
std::uint32_t pixel_at(std::span<const std::uint8_t> rgba8, std::size_t i) {
  std::uint32_t pixel = 0;
  std::memcpy(&pixel, rgba8.data() + 4 * i, sizeof pixel);
  return pixel;
}

/// Sum over the first three channels of the pixels that have a ray. count: at most kMostSquares
std::uint32_t sum_of_squares(const PicturePair& pictures, const RayMask& mask, std::size_t first, std::size_t count) {
  // Multiplied as whole lines of bytes, of which the others are made 0.
  std::array<std::uint32_t, kMostSquares> a;  // NOLINT(*-member-init): all that is read is written
  std::array<std::uint32_t, kMostSquares> b;  // NOLINT(*-member-init)
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t counted = (0U - mask.has_ray[first + i]) & 0xffffffU;
    a[i] = pixel_at(pictures.reference, first + i) & counted;
    b[i] = pixel_at(pictures.test, first + i) & counted;
  }
  const auto* const a_bytes = reinterpret_cast<const std::uint8_t*>(a.data());
  const auto* const b_bytes = reinterpret_cast<const std::uint8_t*>(b.data());
  std::int32_t sum = 0;
  for (std::size_t i = 0; i < 4 * count; ++i) {
    const auto difference = static_cast<std::int16_t>(a_bytes[i] - b_bytes[i]);
    sum += difference * difference;
  }
  return static_cast<std::uint32_t>(sum);
}

/// The rows with the texts that they point to.
class Registry {
 public:
  Registry() {
    std::size_t place = 0;
    for (const Metric& metric : kMetrics)
      for (const Aggregate aggregate : metric.aggregates) {
        rows_.at(place) = row(metric, kAggregates.at(static_cast<std::size_t>(aggregate)), place);
        ++place;
      }
  }
  [[nodiscard]] std::span<const MetricRow> rows() const { return rows_; }

 private:
  MetricRow row(const Metric& metric, const AggregateRow& aggregate, std::size_t place) {
    MetricRow row{.id = metric.id,
                  .unit = metric.unit,
                  .lower_is_better = metric.lower_is_better,
                  .description = metric.description,
                  .metric = &metric,
                  .part = {},
                  .place = place,
                  .compares_pictures = std::holds_alternative<OfPictures>(metric.function) ||
                                       std::holds_alternative<OfMotion>(metric.function),
                  .counts_work = metric.counts_work};
    if (metric.aggregates.size() == 1) return row;
    row.id = ids_.at(place) = fmt::format("{}.{}", metric.id, aggregate.id);
    row.description = descriptions_.at(place) = fmt::format("{}, {}", metric.description, aggregate.description);
    row.part = aggregate.id;
    return row;
  }

  std::array<std::string, kMetricNumbers> ids_;
  std::array<std::string, kMetricNumbers> descriptions_;
  std::array<MetricRow, kMetricNumbers> rows_{};
};

}  // namespace

void e_xy_values(const JudgedPixels& pixels, UnfilledVector<float>& values) {
  append(pixels, values, takes_hits, [](const ScorePixel&, const PixelScore& score) { return score.e_xy; });
}
void e_z_values(const JudgedPixels& pixels, UnfilledVector<float>& values) {
  append(pixels, values, takes_hits, [](const ScorePixel&, const PixelScore& score) { return score.e_z; });
}
void taps_values(const JudgedPixels& pixels, UnfilledVector<float>& values) {
  append(pixels, values, takes_rays, [](const ScorePixel& traced, const PixelScore&) { return traced.taps; });
}

bool is_missed(Verdict verdict) { return verdict == Verdict::missed; }
bool is_inside(Verdict verdict) { return verdict == Verdict::inside; }
bool is_unconverged(Verdict verdict) { return verdict == Verdict::unconverged; }
bool is_false_kill(Verdict verdict) { return verdict == Verdict::false_kill; }
bool is_false_keep(Verdict verdict) { return verdict == Verdict::false_keep; }
bool is_false_coverage(Verdict verdict) { return is_false_kill(verdict) || is_false_keep(verdict); }

float false_lit(float found, float exact) { return found >= kHalfLit && exact < kHalfLit ? 1.0F : 0.0F; }
float false_dark(float found, float exact) { return found < kHalfLit && exact >= kHalfLit ? 1.0F : 0.0F; }
float penumbra_error(float found, float exact) { return std::abs(found - exact); }

float depth_error(float found, float exact) {
  // near / distance, of what a depth buffer holds
  const auto closeness = [](float depth) { return 1 - static_cast<double>(depth) * (kDepthRange - 1) / kDepthRange; };
  return static_cast<float>(std::abs(closeness(exact) / closeness(found) - 1));
}

std::optional<double> wrong_visible(const PicturePair& pictures, const RayMask& mask) {
  const auto is_object = [](std::uint32_t pixel) {
    const SeenObject seen{static_cast<std::uint8_t>(pixel >> 24U)};
    return seen == SeenObject::square || seen == SeenObject::ball;
  };
  const Seen whole = sum_of_shares(mask.has_ray.size(), [&](std::size_t first, std::size_t count) {
    std::uint32_t objects = 0;
    std::uint32_t wrong = 0;
    for (std::size_t i = first; i < first + count; ++i) {
      const std::uint32_t exact = pixel_at(pictures.reference, i);
      const std::uint32_t found = pixel_at(pictures.test, i);
      objects += static_cast<std::uint32_t>(is_object(exact)) | static_cast<std::uint32_t>(is_object(found));
      wrong += (exact ^ found) >> 24U != 0 ? mask.has_ray[i] : 0U;
    }
    return Seen{.objects = objects, .wrong = wrong};
  });
  if (whole.objects == 0 || mask.count == 0) return std::nullopt;
  return static_cast<double>(whole.wrong) / static_cast<double>(mask.count);
}

std::optional<double> psnr(const PicturePair& pictures, const RayMask& mask) {
  assert(pictures.reference.size() == 4 * mask.has_ray.size() && pictures.test.size() == pictures.reference.size());
  const std::int64_t squares = sum_of_shares(mask.has_ray.size(), [&](std::size_t first, std::size_t count) {
    std::int64_t sum = 0;
    for (std::size_t i = 0; i < count; i += kMostSquares)
      sum += sum_of_squares(pictures, mask, first + i, std::min(kMostSquares, count - i));
    return sum;
  });
  if (squares == 0) return std::nullopt;
  const double mean_square = static_cast<double>(squares) / static_cast<double>(3 * mask.count);
  return 10 * std::log10(255.0 * 255.0 / mean_square);
}

std::span<const MetricRow> metrics() {
  static const Registry registry;
  return registry.rows();
}

const MetricRow& find_metric(std::string_view id) {
  if (const auto place = metric_place(id)) return metrics()[*place];
  fail_unknown("metric", id, ids_of(metrics()));
}

}  // namespace reliefbench
