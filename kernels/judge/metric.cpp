#include <array>
#include <cstddef>
#include <string>
#include <utility>

#include "kernels/base/error.h"
#include "kernels/judge/score.h"

namespace reliefbench {
namespace {

struct ErrorRow {
  std::string_view id;
  std::string_view unit;
  std::string_view description;
  Distribution FrameScore::*distribution;
};
constexpr std::array kErrors{
    ErrorRow{"e_xy", "texels", "error of the hit along the ray's horizontal travel", &FrameScore::e_xy},
    ErrorRow{"e_z", "height", "error of the hit's height", &FrameScore::e_z},
};

struct StatisticRow {
  std::string_view id;
  std::string_view description;
  double Distribution::*value;
};
constexpr std::array kStatistics{
    StatisticRow{"mean", "mean", &Distribution::mean},
    StatisticRow{"p50", "median", &Distribution::p50},
    StatisticRow{"p95", "95th percentile", &Distribution::p95},
    StatisticRow{"p99", "99th percentile", &Distribution::p99},
    StatisticRow{"max", "maximum", &Distribution::max},
};

constexpr std::array kOthers{
    MetricRow{"missed_rate", "share", true, "pixels whose first hit was stepped over",
              [](const FrameScore& score) { return std::optional(score.missed_rate); }},
    MetricRow{"inside_rate", "share", true,
              "pixels that ended inside the first solid, over half a texel from its surface",
              [](const FrameScore& score) { return std::optional(score.inside_rate); }},
    MetricRow{"unconverged_rate", "share", true,
              "pixels that stopped over half a texel before the surface, or as far from it at the step cap",
              [](const FrameScore& score) { return std::optional(score.unconverged_rate); }},
    MetricRow{"psnr", "dB", false, "peak signal-to-noise ratio of the shaded frame",
              [](const FrameScore& score) { return score.psnr; }, true},
    MetricRow{"flip", "1", true, "LDR-FLIP of the shaded frame, mean: how much of a difference is seen, 0 to 1",
              [](const FrameScore& score) { return std::optional(score.flip); }, true},
    MetricRow{"ssim", "1", false, "structural similarity of the shaded frame, mean, up to 1",
              [](const FrameScore& score) { return std::optional(score.ssim); }, true},
    MetricRow{"flicker", "share", true, "change of the shaded frame's error while the camera moves 1/4 texel a frame",
              [](const FrameScore& score) { return score.flicker; }, true},
    MetricRow{"taps.mean", "taps", true, "texture instructions of a pixel, mean",
              [](const FrameScore& score) { return std::optional(score.mean_taps); }, false, true},
    MetricRow{"taps.max", "taps", true, "texture instructions of a pixel, maximum",
              [](const FrameScore& score) { return std::optional(score.max_taps); }, false, true},
};

constexpr std::size_t kDistributionRows = kErrors.size() * kStatistics.size();

template <std::size_t kRow>
std::optional<double> distribution_value(const FrameScore& score) {
  return score.*kErrors[kRow / kStatistics.size()].distribution.*kStatistics[kRow % kStatistics.size()].value;
}

/// The rows of errors x statistics with the texts that they point to, then the others.
class Registry {
 public:
  Registry() : Registry(std::make_index_sequence<kDistributionRows>()) {}
  [[nodiscard]] std::span<const MetricRow> rows() const { return rows_; }

 private:
  template <std::size_t... kRows>
  explicit Registry(std::index_sequence<kRows...>) {
    (add<kRows>(), ...);
    rows_.insert(rows_.end(), kOthers.begin(), kOthers.end());
  }

  template <std::size_t kRow>
  void add() {
    const ErrorRow& error = kErrors[kRow / kStatistics.size()];
    const StatisticRow& statistic = kStatistics[kRow % kStatistics.size()];
    ids_[kRow] = fmt::format("{}.{}", error.id, statistic.id);
    descriptions_[kRow] = fmt::format("{}, {}", error.description, statistic.description);
    rows_.push_back({ids_[kRow], error.unit, true, descriptions_[kRow], distribution_value<kRow>});
  }

  std::array<std::string, kDistributionRows> ids_;
  std::array<std::string, kDistributionRows> descriptions_;
  std::vector<MetricRow> rows_;
};

}  // namespace

std::span<const MetricRow> metrics() {
  static const Registry registry;
  return registry.rows();
}

const MetricRow& find_metric(std::string_view id) {
  std::string choices;
  for (const MetricRow& row : metrics()) {
    if (row.id == id) return row;
    choices += choices.empty() ? "" : ", ";
    choices += row.id;
  }
  fail_input("no metric '{}'; expected one of {}", id, choices);
}

}  // namespace reliefbench
