#include "tuner/measure/claims.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "kernels/base/error.h"
#include "kernels/image/heightmap.h"
#include "kernels/judge/picture_metrics.h"
#include "kernels/judge/score.h"
#include "kernels/maps/cone_map.h"
#include "tuner/measure/progress.h"
#include "tuner/measure/trace_device.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

constexpr int kRounds = 9;  // samples of a frame's time, the rows in turn
constexpr double kBatch_ms = 5;
constexpr double kNsPerMs = 1e6;

using Figures = std::map<std::string, double>;

bool is_time(std::string_view metric) { return metric == "frame_time" || metric == "bake_time"; }

/// Time, width and safety of a row's map, baked by one thread.
void measure_map(const ClaimRow& row, const BakedScene& baked, Wrap wrap, Figures& figures) {
  const MapRow& map = map_of(row.settings);
  if (map.content == MapContent::heights) return;
  BakeRequest request = bake_request(row.settings, baked.map->heights, wrap);
  request.threads = 1;
  const auto start = std::chrono::steady_clock::now();
  const std::vector<float> values = map.bake(request);
  figures["bake_time"] = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  if (map.ratios != 1) return;
  const auto texels = static_cast<double>(values.size());
  figures["mean_ratio"] = std::accumulate(values.begin(), values.end(), 0.0) / texels;
  request.correction = Correction::none;
  request.parameters.clear();  // the exact conservative map has none
  const std::vector<float> exact = bake_conservative(request);
  int wider = 0;
  for (std::size_t i = 0; i < values.size(); ++i) wider += values[i] > exact[i] * (1 + 1e-6F) ? 1 : 0;
  figures["too_wide"] = wider / texels;
}

/// Errors against the exact hits on the heights as they were loaded, as a sweep has them.
void measure_error(TraceDevice& device, const TraceDevice::Frame& frame, const ReferenceTracer& tracer,
                   const Heightfield& heights, Figures& figures) {
  const std::vector<ScorePixel> pixels = device.trace(frame);
  const FrameScore score = judge_frame(pixels, tracer.trace(rays_of(pixels)), heights.width, heights.height).score;
  for (const MetricRow& metric : metrics())
    if (const std::optional<double> value = metric.value(score)) figures[std::string(metric.id)] = *value;
}

/// Median frame times, the rows in turn, so that drift is shared.
void measure_times(TraceDevice& device, std::vector<TraceDevice::Frame>& frames, std::vector<Figures>& measured) {
  std::vector<int> batch;
  for (TraceDevice::Frame& frame : frames) {
    device.session().draw_ns(frame.draw, 1);  // the first draw compiles
    const double frame_ns = device.session().draw_ns(frame.draw, 1);
    batch.push_back(std::max(1, static_cast<int>(std::ceil(kBatch_ms * kNsPerMs / frame_ns))));
  }
  std::vector<std::vector<double>> samples(frames.size());
  for (int round = 0; round < kRounds; ++round)
    for (std::size_t i = 0; i < frames.size(); ++i)
      samples[i].push_back(device.session().draw_ns(frames[i].draw, batch[i]) / batch[i]);
  for (std::size_t i = 0; i < frames.size(); ++i) measured[i]["frame_time"] = median(samples[i]) / kNsPerMs;
}

ClaimResult run_claim(const Claim& claim, TraceDevice& device) {
  SceneBaker baker(load_heightmap(claim.scene.heightmap));
  const Scene& scene = claim.scene.scene;
  const ReferenceTracer tracer(baker.heights(), scene.wrap);
  ClaimResult result{.claim = &claim,
                     .backend = device.info().backend,
                     .device = device.info().name,
                     .is_software = device.info().software,
                     .measured = {},
                     .answers = {}};
  std::vector<TraceDevice::Frame> frames;
  for (const ClaimRow& row : claim.rows) {
    const BakedScene baked = baker.bake(row.settings, claim.scene);
    Figures figures;
    measure_map(row, baked, scene.wrap, figures);
    measure_error(device, device.frame(row.settings, baked, scene, Target::score), tracer, baker.heights(), figures);
    frames.push_back(device.frame(row.settings, baked, scene, Target::color));
    result.measured.push_back(std::move(figures));
  }
  measure_times(device, frames, result.measured);
  for (const ClaimCheck& check : claim.checks)
    result.answers.push_back(judge_claim(claim, check, result.measured, result.is_software));
  return result;
}

}  // namespace

std::string_view claim_verdict_id(ClaimVerdict verdict) {
  constexpr std::array<std::string_view, 3> kIds{"reproduced", "not reproduced", "not testable on this device"};
  return kIds.at(static_cast<std::size_t>(verdict));
}

ClaimAnswer judge_claim(const Claim& claim, const ClaimCheck& check,
                        std::span<const std::map<std::string, double>> measured, bool is_software) {
  const auto value = [&](const std::string& label) -> std::optional<double> {
    const auto row = std::ranges::find(claim.rows, label, &ClaimRow::label);
    const Figures& figures = measured[static_cast<std::size_t>(row - claim.rows.begin())];
    const auto found = figures.find(check.metric);
    return found == figures.end() ? std::nullopt : std::optional(found->second);
  };
  const std::optional<double> of = value(check.of);
  if (!of)
    return {.verdict = ClaimVerdict::not_testable, .numbers = fmt::format("{} has no {}", check.of, check.metric)};
  const auto answer = [&](bool holds, std::string numbers) {
    const bool decides = !is_software || !is_time(check.metric);
    if (!decides) return ClaimAnswer{ClaimVerdict::not_testable, numbers + " (a software rasteriser's)"};
    return ClaimAnswer{holds ? ClaimVerdict::reproduced : ClaimVerdict::not_reproduced, std::move(numbers)};
  };
  if (check.at_most) return answer(*of <= *check.at_most, fmt::format("{:.4g}, at most {:.4g}", *of, *check.at_most));
  const std::optional<double> other = value(check.than.empty() ? check.to : check.than);
  if (!other) return {.verdict = ClaimVerdict::not_testable, .numbers = fmt::format("no {} to compare", check.metric)};
  if (!check.than.empty()) return answer(*of < *other, fmt::format("{:.4g} against {:.4g}", *of, *other));
  const double quotient = *of / *other;
  return answer(std::abs(quotient / check.quotient - 1) <= check.tolerance,
                fmt::format("ours {:.3g}x, the paper's {:.3g}x", quotient, check.quotient));
}

std::vector<ClaimResult> run_claims(std::span<const Claim> claims, const ClaimOptions& options) {
  WallSplit split;
  Progress progress(options.quiet);
  std::vector<ClaimResult> results;
  const auto total = static_cast<double>(claims.size() * options.backends.size());
  for (const std::string& backend : options.backends) {
    TraceDevice device(find_backend(backend), options.device, split, true);
    device.session().calibrate(kBatch_ms, nullptr);
    for (const Claim& claim : claims) {
      progress.update(static_cast<double>(results.size()) / total, fmt::format("{} on {}", claim.id, backend));
      results.push_back(run_claim(claim, device));
    }
  }
  progress.finish();
  return results;
}

nlohmann::json claims_json(std::span<const ClaimResult> results) {
  nlohmann::json list = nlohmann::json::array();
  for (const ClaimResult& result : results) {
    nlohmann::json rows = nlohmann::json::array();
    for (std::size_t i = 0; i < result.claim->rows.size(); ++i) {
      const ClaimRow& row = result.claim->rows[i];
      rows.push_back({{"label", row.label},
                      {"settings", fmt::format("{}?{}", row.settings.technique().id, row.settings.text())},
                      {"paper", row.paper},
                      {"ours", result.measured[i]}});
    }
    nlohmann::json checks = nlohmann::json::array();
    for (std::size_t i = 0; i < result.claim->checks.size(); ++i)
      checks.push_back({{"says", result.claim->checks[i].says},
                        {"verdict", claim_verdict_id(result.answers[i].verdict)},
                        {"numbers", result.answers[i].numbers}});
    list.push_back({{"id", result.claim->id},
                    {"source", result.claim->source},
                    {"about", result.claim->about},
                    {"scene", result.claim->scene.id},
                    {"backend", result.backend},
                    {"device", result.device},
                    {"software", result.is_software},
                    {"rows", std::move(rows)},
                    {"checks", std::move(checks)}});
  }
  return list;
}

}  // namespace reliefbench
