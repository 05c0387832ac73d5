#include "tests/synthetic_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "kernels/base/sha256.h"
#include "kernels/trace/technique.h"
#include "tests/made_score.h"

namespace reliefbench {
namespace {

/// Of so many techniques in turn, after the flat one; a run is the same however many come after them.
constexpr std::size_t kTechniquesInTurn = 18;

Settings random_settings(const Technique& technique, std::mt19937& random) {
  Settings settings(technique);
  for (const Param& param : settings.technique().params) {
    if (!param.is_spelt_out) break;  // features of the scene, which stand last, stay off
    const int last = param.choices.empty() ? std::min(param.max, 128) : static_cast<int>(param.choices.size()) - 1;
    settings.set(param.id, param.min + static_cast<int>(random() % static_cast<unsigned>(last - param.min + 1)));
  }
  return settings;
}

Record base_record(const Settings& settings, const std::string& scene, const std::string& backend,
                   const std::string& device) {
  Record record;
  record.technique = settings.technique().id;
  for (const SettingValue& given : settings.written()) record.params.emplace_back(given.param.id, given.text());
  record.case_id = fmt::format("{}@{}?{}&backend={}", record.technique, scene, settings.text(), backend);
  record.map = map_of(settings).id;
  record.scene = scene;
  record.scene_key = synthetic_scene(scene).key;
  record.backend = backend;
  record.device = device;
  return record;
}

FrameScore score_of(double error, double missed) {
  FrameScore score = made_score();
  score.pixels = 65536;
  score["e_xy.mean"] = error / 9;
  score["e_xy.p50"] = error / 20;
  score["e_xy.p95"] = error / 2;
  score["e_xy.p99"] = error;
  score["e_xy.max"] = error * 12;
  score["e_z.mean"] = error / 900;
  score["e_z.p50"] = error / 2000;
  score["e_z.p95"] = error / 200;
  score["e_z.p99"] = error / 100;
  score["e_z.max"] = error / 8;
  score["missed_rate"] = missed;
  score["inside_rate"] = missed / 3;
  score["unconverged_rate"] = error > 4 ? 0.01 : 0;
  score["taps.mean"] = 12;
  score["taps.max"] = 40;
  if (error > 0) score["psnr"] = 38 - 12 * std::log10(error);
  return score;
}

Record ok_record(const Settings& settings, const std::string& scene, const std::string& backend,
                 const SyntheticRunOptions& options, std::mt19937& random) {
  Record record = base_record(settings, scene, backend, options.device);
  const bool is_flat = settings.technique().id == "flat";
  const double noise = std::exp(std::normal_distribution(0.0, 0.5)(random));
  const double effort = is_flat ? 0 : std::uniform_real_distribution(0.0, 3.0)(random);
  // Never-skipping techniques become exact once they may take enough steps.
  const bool is_exact = settings.technique().guarantee == Guarantee::exact && effort > 1.8;
  const double error = is_exact ? 0 : 30 * noise * std::exp(-1.9 * effort);
  const double missed = is_exact || effort > 1.5 ? 0 : 0.002 * noise;
  const double time = 4e5 * options.slowness * std::exp(effort) * (backend == "vulkan" ? 0.9 : 1) *
                      (is_flat ? 0.5 : std::sqrt(noise) + 0.3);
  record.frame_time =
      FrameTime{.summary = {.median = time, .mad = time * 0.01, .ci_low = time * 0.97, .ci_high = time * 1.04, .n = 7},
                .raw_median = time * 1.02,
                .timer = "fenced_wall"};
  record.error = score_of(error, missed);
  record.memory_bytes = 131072;
  record.bake_time_ns = 3.4e7;
  record.first_draw_ns = 2.1e8;
  return record;
}

void add_failed(Run& run, const std::string& scene, const std::string& backend, const SyntheticRunOptions& options) {
  using enum Status;
  Settings settings(techniques().back());
  for (const Status status :
       {unsupported, compile_error, timeout, device_lost, out_of_memory, invalid_timer, throttled, crashed}) {
    Record record = base_record(settings, scene, backend, options.device);
    record.case_id += fmt::format("&failed={}{}", static_cast<int>(status), kHostileText);
    record.status = status;
    record.reason = fmt::format("what the driver said: {}", kHostileText);
    run.records.push_back(record);
  }
}

nlohmann::json device_info(const std::string& backend, const std::string& device) {
  const std::string own = backend == "vulkan" ? "vk_timestamp" : "gl_timestamp";
  return {{"backend", backend},
          {"index", 0},
          {"name", device},
          {"vendor", "Nobody"},
          {"type", "cpu"},
          {"driver", "synthetic 1.0"},
          {"api_version", "1.3"},
          {"software", true},
          {"subtexel_bits", 8},
          {"timers", {"fenced_wall", own}},
          {"audit",
           {{{"timer", "fenced_wall"}, {"valid", true}, {"wall_ratio", 1.0}, {"doubling", 2.01}, {"reason", ""}},
            {{"timer", own},
             {"valid", false},
             {"wall_ratio", 0.054},
             {"doubling", 1.97},
             {"reason", "device time is 0.054 of the fenced wall time, 0.95 to 1.05 is believed"}}}},
          {"timer", "fenced_wall"},
          {"control_reference_ns", 812345.0}};
}

nlohmann::json run_info(const SyntheticRunOptions& options) {
  nlohmann::json devices = nlohmann::json::array();
  for (const std::string& backend : options.backends) devices.push_back(device_info(backend, options.device));
  return {{"identity", {{"schema", kSchemaVersion}, {"config_sha256", "0123abcd"}, {"filter", ""}}},
          {"name", "synthetic"},
          {"version", "0.1.0"},
          {"git_sha", "15450c1"},
          {"argv", {"reliefbench", "sweep", "configs/quick start.json"}},
          {"started", "2026-11-22T12:00:00Z"},
          {"finished", "2026-11-22T12:07:31Z"},
          {"host", {{"cpu", "Synthetic CPU"}, {"cores", 2}, {"os", "Debian 12"}, {"memory_bytes", 8'000'000'000}}},
          {"config_path", "configs/quick start.json"},
          {"config", {{"name", "synthetic"}}},
          {"devices", devices},
          {"wall_s",
           {{"bake", 3.1},
            {"compile", 12.5},
            {"reference", 1.2},
            {"draw", 5.2},
            {"judge", 2.6},
            {"pictures", 1.1},
            {"warmup", 61.0},
            {"samples", 343.0},
            {"other", 6.3},
            {"total", 436.0}}},
          {"counts",
           {{"cases", 400},
            {"ok", 360},
            {"bakes", 12},
            {"bakes_cached", 4},
            {"references", 6},
            {"references_cached", 0},
            {"shaders", 10}}},
          {"front", {{"error", "e_xy.p99"}, {"constraints", {"missed_rate<=0.001"}}}},
          {"budgets", {"e_xy.p99<=0.5", "missed_rate<=0.001"}}};
}

}  // namespace

MeasuredScene synthetic_scene(const std::string& id) {
  MeasuredScene scene{
      .spec = {.id = id, .heightmap = {.source = "fbm"}, .scene = {}}, .heights_sha256 = sha256(id), .key = {}};
  scene.spec.scene.view.id = view_part(id);
  scene.key = scene_key(scene.heights_sha256, scene.spec.scene);
  return scene;
}

Run synthetic_run(const SyntheticRunOptions& options) {
  Run run;
  for (const std::string& scene : options.scenes) run.scenes.push_back(synthetic_scene(scene));
  run.folder = options.folder;
  run.info = run_info(options);
  std::mt19937 random(options.seed);
  for (const std::string& backend : options.backends) {
    for (const std::string& scene : options.scenes) {
      Settings flat(techniques().front());
      run.records.push_back(ok_record(flat, scene, backend, options, random));
      for (std::size_t i = 1; i < static_cast<std::size_t>(options.cases); ++i) {
        // The number keeps ids apart: random settings may repeat, cases of a plan do not.
        const Technique& technique = techniques()[1 + i % kTechniquesInTurn];
        run.records.push_back(ok_record(random_settings(technique, random), scene, backend, options, random));
        run.records.back().case_id += fmt::format("&case={}", i);
      }
      if (options.with_failed) add_failed(run, scene, backend, options);
    }
  }
  return run;
}

}  // namespace reliefbench
