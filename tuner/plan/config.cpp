#include "tuner/plan/config.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <tuple>

#include "kernels/base/append_file.h"
#include "kernels/base/error.h"
#include "kernels/base/trimmed.h"
#include "kernels/judge/score.h"
#include "tuner/plan/config_reader.h"
#include "tuner/plan/scene_key.h"

namespace reliefbench {
namespace {

std::vector<Budget> read_budgets(const ConfigReader& reader, const JsonNode& node) {
  std::vector<Budget> budgets;
  // Unlike elsewhere an empty list has a meaning: no constraint.
  if (node.value.is_array() && node.children.empty()) return budgets;
  for (const JsonNode& item : reader.items(node)) {
    const std::string text = reader.text(item);
    budgets.push_back(reader.at(item, [&] { return parse_budget(text); }));
  }
  return budgets;
}

void read_front(const ConfigReader& reader, const JsonNode& node, Config& config) {
  reader.check_object(node, "front");
  if (const JsonNode* error = node.find("error")) {
    config.front_error = reader.text(*error);
    const bool is_error = reader.at(*error, [&] { return find_metric(config.front_error).lower_is_better; });
    if (!is_error) reader.fail(*error, fmt::format("'{}' is no error: higher is better", config.front_error));
  }
  if (const JsonNode* constraints = node.find("constraints"))
    config.front_constraints = read_budgets(reader, *constraints);
}

bool same_heightmap(const HeightmapSpec& a, const HeightmapSpec& b) {
  const auto fields = [](const HeightmapSpec& s) {
    return std::tie(s.source, s.channel, s.floor, s.invert, s.normalise, s.width, s.height, s.seed);
  };
  return fields(a) == fields(b);
}

/// What tells a scene from another of the same name.
std::string scene_text(const SceneSpec& spec) {
  const Scene& scene = spec.scene;
  return fmt::format("{} at relief depth {}, tiling {}, {}, {}x{} px", spec.heightmap.source, scene.relief_depth,
                     scene.tiling, wrap_id(scene.wrap), scene.width_px, scene.height_px);
}

void check_ids(const ConfigReader& reader, const JsonNode& node, const std::vector<SceneSpec>& earlier,
               const std::vector<SceneSpec>& added) {
  for (const SceneSpec& scene : added)
    for (const SceneSpec& other : earlier) {
      if (scene.id == other.id)
        reader.fail(
            node,
            fmt::format("a second scene '{}': {}, where the first is {} (give one heightmap or view another name)",
                        scene.id, scene_text(scene), scene_text(other)));
      if (heightmap_part(scene.id) == heightmap_part(other.id) && !same_heightmap(scene.heightmap, other.heightmap))
        reader.fail(node, fmt::format("another heightmap is called '{}' already: {} (give this one, {}, a \"name\")",
                                      heightmap_part(scene.id), other.heightmap.source, scene.heightmap.source));
    }
}

}  // namespace

MeasureSpec read_measure(const ConfigReader& reader, const JsonNode& node) {
  reader.check_object(node, "measure");
  MeasureSpec spec;
  const auto count = [&](std::string_view key, int& value, int low, int high) {
    if (const JsonNode* child = node.find(key)) value = static_cast<int>(reader.integer(*child, low, high));
  };
  const auto positive = [&](std::string_view key, double& value, double high) {
    if (const JsonNode* child = node.find(key))
      value = reader.number(*child, {.low = 0, .high = high, .above_low = true});
  };
  count("samples", spec.samples, 1, 10000);
  positive("batch_ms", spec.batch_ms, kLongestBatch_ms);
  count("warmup_batches_max", spec.warmup_batches_max, 0, 10000);
  count("control_every", spec.control_every, 1, 10000);
  count("block_cases", spec.block_cases, 1, 100000);
  count("flicker_frames", spec.flicker_frames, 0, 64);
  positive("timeout_s", spec.timeout_s, std::numeric_limits<double>::infinity());
  if (const JsonNode* batch = node.find("batch_ms");
      batch != nullptr && spec.batch_ms * 1e-3 >= std::max(spec.timeout_s, kLeastRenderLimit_s))
    reader.fail(*batch,
                fmt::format("a batch of {} ms is not done within timeout_s, which is {}: no case would be timed",
                            spec.batch_ms, spec.timeout_s));
  return spec;
}

std::vector<SceneSpec> read_scenes(const ConfigReader& reader, const JsonNode& node,
                                   const std::filesystem::path& folder) {
  std::vector<SceneSpec> scenes;
  for (const JsonNode& item : reader.items(node)) {
    const std::vector<SceneSpec> added = read_scene(reader, item, folder);
    for (auto scene = added.begin(); scene != added.end(); ++scene)
      if (std::ranges::find(added.begin(), scene, scene->id, &SceneSpec::id) != scene)
        reader.fail(item, fmt::format("view '{}' stands twice", scene->scene.view.id));
    check_ids(reader, item, scenes, added);
    scenes.insert(scenes.end(), added.begin(), added.end());
  }
  return scenes;
}

std::string Budget::text() const {
  return fmt::format("{}{}{}", metric, find_metric(metric).lower_is_better ? "<=" : ">=", limit);
}

Budget parse_budget(std::string_view text) {
  const std::size_t at = std::min(text.find("<="), text.find(">="));
  if (at == std::string_view::npos) fail_input("'{}' is no bound (expected e.g. 'e_xy.p99<=0.5')", text);
  const MetricRow& metric = find_metric(trimmed(text.substr(0, at), " "));
  if ((text[at] == '<') != metric.lower_is_better)
    fail_input("'{}': {} is better {}, so its bound is '{}'", text, metric.id,
               metric.lower_is_better ? "lower" : "higher", metric.lower_is_better ? "<=" : ">=");
  const std::string_view number = trimmed(text.substr(at + 2), " ");
  double limit = 0;
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), limit);
  if (error != std::errc{} || end != number.data() + number.size() || !std::isfinite(limit))
    fail_input("'{}': '{}' is not a number", text, number);
  return {.metric = std::string(metric.id), .limit = limit};
}

std::vector<Budget> parse_budgets(std::span<const std::string> texts) {
  std::vector<Budget> budgets;
  budgets.reserve(texts.size());
  for (const std::string& text : texts) budgets.push_back(parse_budget(text));
  return budgets;
}

std::vector<std::string> budget_texts(std::span<const Budget> budgets) {
  std::vector<std::string> texts;
  texts.reserve(budgets.size());
  for (const Budget& budget : budgets) texts.push_back(budget.text());
  return texts;
}

Config load_config(const std::filesystem::path& path) { return parse_config(read_file(path), path); }

Config parse_config(std::string text, const std::filesystem::path& path) {
  const ConfigReader reader(path.string());
  const JsonNode root = parse_json_document(text, path.string());
  reader.check_object(root, "config");

  Config config{.path = path,
                .text = std::move(text),
                .name = path.stem().string(),
                .included = {},
                .scenes = {},
                .sweeps = {},
                .measure = {}};
  if (const JsonNode* name = root.find("name")) config.name = reader.text(*name);
  if (const JsonNode* seed = root.find("seed"))
    config.seed = static_cast<std::uint64_t>(reader.integer(*seed, 0, std::numeric_limits<std::int64_t>::max()));
  config.scenes = read_scenes(reader, reader.required(root, "scenes"), config.path.parent_path());
  if (const JsonNode* measure = root.find("measure")) config.measure = read_measure(reader, *measure);
  if (const JsonNode* front = root.find("front")) read_front(reader, *front, config);
  if (const JsonNode* budgets = root.find("budgets")) config.budgets = read_budgets(reader, *budgets);
  for (const JsonNode& sweep : reader.items(reader.required(root, "sweeps")))
    if (sweep.find("presets") != nullptr)
      read_presets_sweep(reader, sweep, config);
    else
      config.sweeps.push_back(read_sweep(reader, sweep));
  return config;
}

}  // namespace reliefbench
