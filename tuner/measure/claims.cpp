#include "tuner/measure/claims.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <numeric>
#include <utility>

#include "kernels/base/error.h"
#include "kernels/image/heightmap.h"
#include "kernels/judge/score.h"
#include "kernels/maps/map_verify.h"
#include "kernels/trace/surface_tracer.h"
#include "tuner/measure/attempt.h"
#include "tuner/measure/claim_maps.h"
#include "tuner/measure/frame_draws.h"
#include "tuner/measure/frame_size.h"
#include "tuner/measure/judged.h"
#include "tuner/measure/progress.h"
#include "tuner/measure/timed_in_turns.h"
#include "tuner/plan/scene_key.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/record.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

constexpr int kRounds = 9;          // samples of a row's time
constexpr int kContestRounds = 10;  // half of them choose
constexpr double kBatch_ms = 5;
constexpr double kTimeout_s = 300;  // a software rasteriser takes seconds
constexpr int kLargeMap_px = 512;   // a side, as the papers'

using Values = std::map<std::string, double>;

/// What is proved of a row's map as it is stored.
void verify(const BakeSpec& spec, const MapTextures& textures, Values& figures) {
  const MapVerdict verdict = verify_map({.map = spec.storage.map,
                                         .textures = textures,
                                         .format = spec.storage.format,
                                         .encoding = spec.storage.encoding,
                                         .correction = spec.storage.correction,
                                         .wrap = spec.wrap,
                                         .parameters = spec.parameters});
  figures["violations"] = static_cast<double>(verdict.violations());
  figures["undecided"] = static_cast<double>(verdict.cells.undecided);
}

/// Time, width and safety of a row's map.
void measure_map(const BakeSpec& spec, const MapOfRow& made, const Heightfield& heights, ClaimFigures& measured) {
  const BakedMap& map = made.map;
  const MapStorage& storage = spec.storage;
  if (storage.map.content == MapContent::heights) return;
  Values& figures = measured.values;
  measured.untimed = made.untimed;
  if (made.untimed.empty()) figures["bake_time"] = map.bake_time_ns / kNsPerMs;
  if (storage.map.ratios != 1) return;
  const auto texels = static_cast<double>(map.values.size());
  figures["mean_ratio"] = std::accumulate(map.values.begin(), map.values.end(), 0.0) / texels;
  const BakedMap exact = bake({.storage = {.map = find_map(MapKind::conservative),
                                           .format = storage.format,
                                           .encoding = storage.encoding,
                                           .max_ratio = storage.max_ratio},
                               .wrap = spec.wrap},
                              heights);
  int wider = 0;
  for (std::size_t i = 0; i < map.values.size(); ++i) wider += map.values[i] > exact.values[i] * (1 + 1e-6F) ? 1 : 0;
  figures["too_wide"] = wider / texels;
}

/// What claims are measured on.
struct Bench {
  Session& session;
  WallSplit& split;
  Progress& progress;
  double cooling_pause_s;
  const std::function<bool()>& is_interrupted;
};

/// Median frame times, corrected for drift, of draws that are timed in turn; none where the device was held back.
/// returns: what says that it was, ""
std::string measure_times(const Bench& bench, const std::vector<std::vector<Draw>>& draws, int rounds,
                          std::vector<ClaimFigures>& measured) {
  const MeasureSpec measure{.samples = rounds, .batch_ms = kBatch_ms};
  std::vector<Record> records(draws.size());
  std::vector<TimedCase> cases;
  cases.reserve(draws.size());
  for (std::size_t i = 0; i < draws.size(); ++i) {
    records[i].case_id = fmt::format("row {}", i);
    cases.push_back({.record = &records[i], .draws = draws[i]});
  }
  TimesInTurns timed = timed_in_turns({.session = bench.session,
                                       .measure = measure,
                                       .split = bench.split,
                                       .progress = bench.progress,
                                       .cooling_pause_s = bench.cooling_pause_s},
                                      cases);
  for (std::size_t i = 0; i < timed.times_ns.size(); ++i) {
    measured[i].times_ns = std::move(timed.times_ns[i]);
    measured[i].values["frame_time"] = median(measured[i].times_ns) / kNsPerMs;
  }
  return timed.held_back;
}

/// Whether it is no known heightmap, or its file is there.
bool is_at_hand(const HeightmapSpec& spec) {
  const auto row = std::ranges::find(known_heightmaps(), spec.source, &KnownHeightmapRow::id);
  return row == known_heightmaps().end() || std::ranges::any_of(heightmap_folders(), [&](const auto& folder) {
           std::error_code ignored;
           return std::filesystem::exists(folder / row->file, ignored);
         });
}

/// Whether it is decided by what draw_block() times.
bool rests_on_frame_times(const ClaimCheck& check) { return check.is_contest() || check.metric == "frame_time"; }

/// returns: nullopt where it was interrupted
std::optional<SceneFigures> run_scene(const Claim& claim, const SceneSpec& spec, const Heightfield& heights,
                                      const Bench& bench) {
  SceneFigures result{.scene = &spec, .map_px = {heights.width, heights.height}};
  Session& session = bench.session;
  Backend& backend = session.backend();
  const Scene& scene = spec.scene;
  const ReferenceTracer tracer(heights, scene.wrap);
  const UploadedScene uploaded = upload(backend, scene, heights);
  ClaimMaps maps(claim, spec, heights, session);
  const bool verifies = claim.asks_for("violations") || claim.asks_for("undecided");
  std::vector<Frame> frames;
  std::vector<std::vector<Draw>> draws;
  for (const ClaimRow& row : claim.rows) {
    if (bench.is_interrupted()) return std::nullopt;
    const MapOfRow& made = maps.map_of(row.settings);
    const std::optional<MapTextures> textures = pack(row.settings, made.map, scene);
    const Frame& frame = frames.emplace_back(upload(backend, textures, uploaded));
    draws.push_back(shaded_draws(session, row.settings, scene, frame.draw));
    const JudgedFrame judged = judged_by_exact(session, row.settings, scene, frame.draw, uploaded, tracer);
    ClaimFigures& measured = result.rows.emplace_back();
    const BakeSpec baked = bake_spec(row.settings, scene.wrap);
    if (!claim.is_contest()) measure_map(baked, made, heights, measured);
    if (verifies && textures && can_be_verified(baked.storage.map)) verify(baked, *textures, measured.values);
    for (const MetricRow& metric : metrics())
      if (const std::optional<double> value = metric.value(judged.score))
        measured.values[std::string(metric.id)] = *value;
  }
  result.held_back = measure_times(bench, draws, claim.is_contest() ? kContestRounds : kRounds, result.rows);
  return result;
}

/// run_scene(), or why it can't be drawn.
std::optional<SceneFigures> try_scene(const Claim& claim, const SceneSpec& spec, const Bench& bench) {
  const Heightfield heights = load_heightmap(spec.heightmap);
  std::optional<SceneFigures> figures;
  std::string failure = attempt(bench.session, [&] { figures = run_scene(claim, spec, heights, bench); });
  if (failure.empty()) return figures;
  return SceneFigures{.scene = &spec, .map_px = {heights.width, heights.height}, .failure = std::move(failure)};
}

ClaimAnswer answer_of(const Claim& claim, const ClaimCheck& check, const ClaimResult& result) {
  if (result.scenes.empty())
    return {.verdict = ClaimVerdict::not_testable, .numbers = "interrupted before a scene was drawn"};
  for (const SceneFigures& scene : result.scenes)
    if (!scene.failure.empty())
      return {.verdict = ClaimVerdict::not_testable, .numbers = fmt::format("{}: {}", scene.scene->id, scene.failure)};
  if (rests_on_frame_times(check))
    for (const SceneFigures& scene : result.scenes)
      if (!scene.held_back.empty())
        return {.verdict = ClaimVerdict::throttled, .numbers = fmt::format("{}: {}", scene.scene->id, scene.held_back)};
  ClaimAnswer answer = check.is_contest() ? judge_contest(claim, check, result.scenes)
                                          : judge_in_each(claim, check, result.scenes, result.is_software);
  if (answer.verdict == ClaimVerdict::not_reproduced && !check.why.empty()) answer.numbers += "; " + check.why;
  return answer;
}

/// tell: is told each scene as it begins
ClaimResult run_claim(const Claim& claim, const Bench& bench, const std::function<void(const SceneSpec&)>& tell) {
  const DeviceInfo& device = bench.session.device();
  ClaimResult result{.claim = &claim,
                     .backend = device.backend,
                     .device = device.name,
                     .is_software = device.software,
                     .scenes = {},
                     .missing = {},
                     .answers = {}};
  for (const SceneSpec& scene : claim.scenes) {
    const std::string& source = scene.heightmap.source;
    if (claim.scenes.size() > 1 && !is_at_hand(scene.heightmap)) {
      if (std::ranges::find(result.missing, source) == result.missing.end()) result.missing.push_back(source);
      continue;
    }
    std::optional<SceneFigures> figures;
    if (!bench.is_interrupted()) {
      tell(scene);
      figures = try_scene(claim, scene, bench);
    }
    if (figures)
      result.scenes.push_back(std::move(*figures));
    else
      ++result.undone;
  }
  if (result.scenes.empty() && result.undone == 0)
    fail_input("claim {}: none of its heightmaps is there; run `./dev setup`", claim.id);
  for (const ClaimCheck& check : claim.checks) result.answers.push_back(answer_of(claim, check, result));
  return result;
}

/// Of an image nothing: it has the size that it has.
void enlarge_map(SceneSpec& scene) {
  HeightmapSpec& map = scene.heightmap;
  const bool has_own_name = heightmap_part(scene.id) != heightmap_name(map);
  map.width = std::max(map.width, kLargeMap_px);
  map.height = std::max(map.height, kLargeMap_px);
  if (!has_own_name) scene.id = fmt::format("{}/{}", heightmap_name(map), view_part(scene.id));
}

bool has_compute_row(const Claim& claim) {
  return std::ranges::any_of(claim.rows, [](const ClaimRow& row) { return is_by_compute(row.settings); });
}

nlohmann::json row_json(const SceneFigures& scene, const ClaimRow& row, std::size_t i) {
  nlohmann::json line = {{"label", row.label},
                         {"scene", scene.scene->id},
                         {"map_px", {scene.map_px.width, scene.map_px.height}},
                         {"frame_px", {scene.scene->scene.width_px, scene.scene->scene.height_px}},
                         {"settings", setting_id(row.settings)},
                         {"paper", row.paper},
                         {"ours", scene.rows[i].values}};
  if (!row.source.empty()) line["source"] = row.source;
  return line;
}

nlohmann::json check_json(const ClaimCheck& check, const ClaimAnswer& answer) {
  nlohmann::json duels = nlohmann::json::array();
  for (const ClaimDuel& duel : answer.duels)
    duels.push_back(
        {{"scene", duel.scene}, {"of", duel.of}, {"by", duel.by}, {"times_as_fast", summary_json(duel.times_as_fast)}});
  return {{"says", check.says},
          {"verdict", claim_verdict_id(answer.verdict)},
          {"numbers", answer.numbers},
          {"table", answer.table},
          {"duels", std::move(duels)}};
}

}  // namespace

std::string_view claim_verdict_id(ClaimVerdict verdict) {
  constexpr std::array<std::string_view, 4> kIds{"reproduced", "not reproduced", "not testable on this device",
                                                 "throttled"};
  return kIds.at(static_cast<std::size_t>(verdict));
}

std::string set_sizes(std::span<Claim> claims, std::span<const DeviceInfo> devices, std::optional<Size> frame_px) {
  const DefaultFrame frame = default_frame(devices);
  const bool is_hardware = frame.size_px.has_value();
  const std::optional<Size> size_px = frame_px ? frame_px : frame.size_px;
  for (Claim& claim : claims) {
    if (size_px) set_frames(claim.scenes, *size_px);
    if (is_hardware) std::ranges::for_each(claim.scenes, enlarge_map);
  }
  if (!is_hardware) return "";
  return fmt::format("{}procedural heightmaps are {}x{} at least on hardware; --quick draws the claims' own",
                     frame_px ? "" : frame.why + "; ", kLargeMap_px, kLargeMap_px);
}

std::vector<ClaimResult> run_claims(std::span<const Claim> claims, const ClaimOptions& options) {
  WallSplit split;
  Progress progress(options.quiet);
  std::vector<ClaimResult> results;
  const auto total = static_cast<double>(claims.size() * options.backends.size());
  const bool has_compute = std::ranges::any_of(claims, has_compute_row);
  for (const std::string& backend : options.backends) {
    Session session(find_backend(backend), options.device, split,
                    {.audits = audits_for(has_compute), .open = options.open, .timeout_s = kTimeout_s});
    if (!has_compute && !session.device().software && std::ranges::any_of(claims, asks_for_bakes))
      session.audit_compute_timers();
    if (!options.is_interrupted()) session.calibrate(kBatch_ms, nullptr);
    const Bench bench{.session = session,
                      .split = split,
                      .progress = progress,
                      .cooling_pause_s = options.cooling_pause_s,
                      .is_interrupted = options.is_interrupted};
    for (const Claim& claim : claims) {
      double scenes = 0;
      results.push_back(run_claim(claim, bench, [&](const SceneSpec& scene) {
        const double done = static_cast<double>(results.size()) + scenes++ / static_cast<double>(claim.scenes.size());
        progress.update(done / total, fmt::format("{} on {}, {}", claim.id, backend, scene.id));
      }));
    }
  }
  progress.finish();
  return results;
}

nlohmann::json claims_json(std::span<const ClaimResult> results) {
  nlohmann::json list = nlohmann::json::array();
  for (const ClaimResult& result : results) {
    nlohmann::json rows = nlohmann::json::array();
    for (const SceneFigures& scene : result.scenes)
      for (std::size_t i = 0; i < scene.rows.size(); ++i) rows.push_back(row_json(scene, result.claim->rows[i], i));
    nlohmann::json checks = nlohmann::json::array();
    for (std::size_t i = 0; i < result.claim->checks.size(); ++i)
      checks.push_back(check_json(result.claim->checks[i], result.answers[i]));
    list.push_back({{"id", result.claim->id},
                    {"source", result.claim->source},
                    {"about", result.claim->about},
                    {"missing", result.missing},
                    {"backend", result.backend},
                    {"device", result.device},
                    {"software", result.is_software},
                    {"rows", std::move(rows)},
                    {"checks", std::move(checks)}});
    if (result.undone > 0) list.back()["undone"] = result.undone;
  }
  return list;
}

}  // namespace reliefbench
