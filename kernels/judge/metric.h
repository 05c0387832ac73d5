#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

#include "kernels/judge/picture_metrics.h"
#include "kernels/judge/score_pixel.h"

namespace reliefbench {

/// How one number is made of the values of a frame's pixels. A percentile is by nearest rank: a value that occurred.
enum class Aggregate { mean, p50, p95, p99, max };
struct AggregateRow {
  std::string_view id;
  std::string_view description;
};
inline constexpr std::array kAggregates{// in the order of Aggregate
                                        AggregateRow{"mean", "mean"}, AggregateRow{"p50", "median"},
                                        AggregateRow{"p95", "95th percentile"}, AggregateRow{"p99", "99th percentile"},
                                        AggregateRow{"max", "maximum"}};

/// Metric::feature of what tells which rays pass: through a solid, or beside the relief of a curved surface.
inline constexpr std::string_view kOfSolid = "solid";
inline constexpr std::string_view kOfSilhouette = "silhouette";

inline constexpr std::array kMean{Aggregate::mean};
inline constexpr std::array kMeanAndMax{Aggregate::mean, Aggregate::max};
inline constexpr std::array kDistribution{Aggregate::mean, Aggregate::p50, Aggregate::p95, Aggregate::p99,
                                          Aggregate::max};

/// What it means that a metric has no value for a frame.
enum class NoValue {
  never,       ///< every judged frame has one
  identical,   ///< the pictures are the same: nothing is better
  unmeasured,  ///< nobody looked. So is a metric that a file is too old to know, and it alone may be absent there
};

/// A metric's function, by what it looks at.
using OfPixels = void (*)(const JudgedPixels& pixels,
                          UnfilledVector<float>& values);  ///< appends one a judged pixel, none negative
using OfVerdict = bool (*)(Verdict verdict);               ///< whether a pixel counts: a share
using OfPictures = std::optional<double> (*)(const PicturePair& pictures, const RayMask& mask);
using OfFeature = float (*)(float found, float exact);  ///< of a pixel that has both, not negative
using OfMotion = std::optional<double> (*)(const FlickerFrame& before, const FlickerFrame& now);  ///< one a frame

/// A metric: one row here, and its function. Records, table.csv, the schema, pages and `list` follow.
struct Metric {
  std::string_view id;
  std::string_view unit;
  bool lower_is_better = true;
  std::optional<double> low{};  ///< least value that makes sense; none: unbounded
  std::optional<double> high{};
  std::string_view description;
  std::span<const Aggregate> aggregates = kMean;  ///< one: the metric goes by its id; more: by "id.aggregate"
  NoValue no_value = NoValue::never;
  std::string_view column{};  ///< id of its number that tables show whatever the front's metric is; "": none
  bool counts_work = false;   ///< foretells the frame's time
  /// A frame without this feature of the scene has no value; OfFeature compares the feature's values. OfVerdict is a
  /// share of all pixels with a ray; without a feature, of those with two hits.
  std::string_view feature{};
  std::variant<OfPixels, OfPictures, OfMotion, OfFeature, OfVerdict> function;
};

void e_xy_values(const JudgedPixels& pixels, UnfilledVector<float>& values);
void e_z_values(const JudgedPixels& pixels, UnfilledVector<float>& values);
void taps_values(const JudgedPixels& pixels, UnfilledVector<float>& values);
[[nodiscard]] bool is_missed(Verdict verdict);
[[nodiscard]] bool is_inside(Verdict verdict);
[[nodiscard]] bool is_unconverged(Verdict verdict);
[[nodiscard]] bool is_false_kill(Verdict verdict);
[[nodiscard]] bool is_false_keep(Verdict verdict);
[[nodiscard]] bool is_false_coverage(Verdict verdict);
[[nodiscard]] float false_lit(float found, float exact);
[[nodiscard]] float false_dark(float found, float exact);
[[nodiscard]] float penumbra_error(float found, float exact);
[[nodiscard]] float depth_error(float found, float exact);
[[nodiscard]] std::optional<double> wrong_visible(const PicturePair& pictures, const RayMask& mask);
[[nodiscard]] std::optional<double> psnr(const PicturePair& pictures, const RayMask& mask);

inline constexpr std::array kMetrics{
    Metric{.id = "e_xy",
           .unit = "texels",
           .low = 0,
           .description = "error of the hit along the ray's horizontal travel",
           .aggregates = kDistribution,
           .column = "e_xy.p99",
           .function = e_xy_values},
    Metric{.id = "e_z",
           .unit = "height",
           .low = 0,
           .description = "error of the hit's height",
           .aggregates = kDistribution,
           .function = e_z_values},
    Metric{.id = "missed_rate",
           .unit = "share",
           .low = 0,
           .high = 1,
           .description = "pixels whose first hit was stepped over",
           .column = "missed_rate",
           .function = is_missed},
    Metric{.id = "inside_rate",
           .unit = "share",
           .low = 0,
           .high = 1,
           .description = "pixels that ended inside the first solid, over half a texel from its surface",
           .function = is_inside},
    Metric{.id = "unconverged_rate",
           .unit = "share",
           .low = 0,
           .high = 1,
           .description = "pixels that stopped over half a texel before the surface, or as far from it at the step cap",
           .function = is_unconverged},
    Metric{.id = "psnr",
           .unit = "dB",
           .lower_is_better = false,
           .description = "peak signal-to-noise ratio of the shaded frame",
           .no_value = NoValue::identical,
           .column = "psnr",
           .function = psnr},
    Metric{.id = "flip",
           .unit = "1",
           .low = 0,
           .high = 1,
           .description = "LDR-FLIP of the shaded frame, mean: how much of a difference is seen, 0 to 1",
           .no_value = NoValue::unmeasured,
           .function = flip_mean},
    Metric{.id = "ssim",
           .unit = "1",
           .lower_is_better = false,
           .low = -1,
           .high = 1,
           .description = "structural similarity of the shaded frame, mean, up to 1",
           .no_value = NoValue::unmeasured,
           .function = ssim_mean},
    Metric{.id = "flicker",
           .unit = "share",
           .low = 0,
           .high = 2,
           .description = "change of the shaded frame's error while the camera moves 1/4 texel a frame",
           .no_value = NoValue::unmeasured,
           .function = flicker},
    Metric{.id = "false_lit_rate",
           .unit = "share",
           .low = 0,
           .high = 1,
           .description = "pixels that are lit by half or more and should be by less",
           .no_value = NoValue::unmeasured,
           .feature = "shadow",
           .function = false_lit},
    Metric{.id = "false_dark_rate",
           .unit = "share",
           .low = 0,
           .high = 1,
           .description = "pixels that are lit by less than half and should be by more",
           .no_value = NoValue::unmeasured,
           .feature = "shadow",
           .function = false_dark},
    Metric{.id = "penumbra_error",
           .unit = "share",
           .low = 0,
           .high = 1,
           .description = "error of the share of the light that a pixel has",
           .no_value = NoValue::unmeasured,
           .feature = "shadow",
           .function = penumbra_error},
    Metric{.id = "e_depth",
           .unit = "share",
           .low = 0,
           .description = "error of the depth that was written, as a share of the exact distance along the view's axis",
           .no_value = NoValue::unmeasured,
           .feature = "depth",
           .function = depth_error},
    Metric{.id = "wrong_visible_rate",
           .unit = "share",
           .low = 0,
           .high = 1,
           .description = "pixels that show the relief in place of another object, or the other way round",
           .no_value = NoValue::unmeasured,
           .feature = "depth",
           .function = wrong_visible},
    Metric{.id = "false_kill_rate",
           .unit = "share",
           .low = 0,
           .high = 1,
           .description = "pixels of a curved surface that show no relief and should",
           .no_value = NoValue::unmeasured,
           .feature = kOfSilhouette,
           .function = is_false_kill},
    Metric{.id = "false_keep_rate",
           .unit = "share",
           .low = 0,
           .high = 1,
           .description = "pixels of a curved surface that show relief and should not: its silhouette is beside them",
           .no_value = NoValue::unmeasured,
           .feature = kOfSilhouette,
           .function = is_false_keep},
    Metric{.id = "false_hole_rate",
           .unit = "share",
           .low = 0,
           .high = 1,
           .description = "pixels whose ray passed a solid that it should have met",
           .no_value = NoValue::unmeasured,
           .feature = kOfSolid,
           .function = is_false_kill},
    Metric{.id = "false_solid_rate",
           .unit = "share",
           .low = 0,
           .high = 1,
           .description = "pixels whose ray stopped and should have passed the solid",
           .no_value = NoValue::unmeasured,
           .feature = kOfSolid,
           .function = is_false_keep},
    Metric{.id = "coverage_error",
           .unit = "share",
           .low = 0,
           .high = 1,
           .description = "pixels that show the solid in place of what is behind it, or the other way round",
           .no_value = NoValue::unmeasured,
           .feature = kOfSolid,
           .function = is_false_coverage},
    Metric{.id = "taps",
           .unit = "taps",
           .low = 0,
           .description = "texture instructions of a pixel",
           .aggregates = kMeanAndMax,
           .column = "taps.mean",
           .counts_work = true,
           .function = taps_values},
};

/// How many numbers the metrics are: one an aggregate.
inline constexpr std::size_t kMetricNumbers = [] {
  std::size_t count = 0;
  for (const Metric& metric : kMetrics) count += metric.aggregates.size();
  return count;
}();

/// Place of a number among all; none if there is no such id.
[[nodiscard]] constexpr std::optional<std::size_t> metric_place(std::string_view id) {
  std::size_t place = 0;
  for (const Metric& metric : kMetrics) {
    if (metric.aggregates.size() == 1 && id == metric.id) return place;
    const bool has_parts = metric.aggregates.size() > 1 && id.size() > metric.id.size() && id.starts_with(metric.id) &&
                           id[metric.id.size()] == '.';
    for (const Aggregate aggregate : metric.aggregates) {
      if (has_parts && id.substr(metric.id.size() + 1) == kAggregates.at(static_cast<std::size_t>(aggregate)).id)
        return place;
      ++place;
    }
  }
  return std::nullopt;
}

/// A number that code names, e.g. "e_xy.p99": one that no metric has does not compile.
class MetricId {
 public:
  // NOLINTNEXTLINE(google-explicit-constructor): written as a literal where it is used
  consteval MetricId(const char* id) : place_(metric_place(id).value()) {}
  [[nodiscard]] constexpr std::size_t place() const { return place_; }

 private:
  std::size_t place_;
};

/// What a frame scored: a value for each number of each metric.
struct FrameScore {
  std::int64_t pixels = 0;                                     ///< with a ray
  std::array<std::optional<double>, kMetricNumbers> values{};  ///< in the order of metrics(); none: NoValue

  [[nodiscard]] std::optional<double>& operator[](MetricId id) { return values.at(id.place()); }
  [[nodiscard]] std::optional<double> operator[](MetricId id) const { return values.at(id.place()); }
  /// One that the frame was judged for. throws: std::bad_optional_access if it was not
  [[nodiscard]] double at(MetricId id) const { return values.at(id.place()).value(); }
  bool operator==(const FrameScore&) const = default;
};

/// One number of a metric, as budgets, columns and reports name it: "e_xy.p99", "missed_rate", "psnr".
struct MetricRow {
  std::string_view id;
  std::string_view unit;
  bool lower_is_better;
  std::string_view description;
  const Metric* metric;
  std::string_view part;   ///< the aggregate's id; "" where the metric is one number
  std::size_t place;       ///< in FrameScore::values
  bool compares_pictures;  ///< shaded frames, not hits or features' values
  bool counts_work;

  [[nodiscard]] std::optional<double> value(const FrameScore& score) const { return score.values.at(place); }
  /// No value is the best there is, not one that is not known.
  [[nodiscard]] bool none_is_best() const { return metric->no_value == NoValue::identical; }
  [[nodiscard]] bool is_column() const { return id == metric->column; }
};
[[nodiscard]] std::span<const MetricRow> metrics();
[[nodiscard]] const MetricRow& find_metric(std::string_view id);  ///< throws: Error(bad_input) listing the choices

}  // namespace reliefbench
