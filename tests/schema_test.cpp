#include "tests/schema.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <set>

#include "kernels/base/error.h"
#include "tests/full_record.h"
#include "tuner/decide/pareto.h"
#include "tuner/plan/config_reader.h"
#include "tuner/plan/plan.h"
#include "tuner/results/store.h"

namespace reliefbench {
namespace {

using nlohmann::json;

std::set<std::string> keys_of(const json& object) {
  std::set<std::string> keys;
  for (const auto& item : object.items()) keys.insert(item.key());
  return keys;
}

json parsed(std::string_view text) { return json::parse(text, nullptr, true, /*ignore_comments=*/true); }

std::vector<std::filesystem::path> shipped_configs() {
  std::vector<std::filesystem::path> paths;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::filesystem::path(RELIEFBENCH_SOURCE_DIR) / "configs"))
    if (entry.path().extension() == ".json") paths.push_back(entry.path());
  return paths;
}

TEST(Schema, HasTheKeysThatTheLoaderKnows) {
  const json definitions = load_schema("config")["definitions"];
  std::set<std::string> closed;  // definitions that name all their keys
  for (const auto& item : definitions.items())
    if (item.value().value("additionalProperties", json()) == false) closed.insert(item.key());
  std::set<std::string> known;
  for (const ConfigKeys& object : config_keys()) {
    known.insert(std::string(object.object));
    EXPECT_EQ(keys_of(definitions[std::string(object.object)]["properties"]),
              std::set<std::string>(object.keys.begin(), object.keys.end()))
        << object.object;
  }
  EXPECT_EQ(closed, known);
}

TEST(Schema, DefaultsAreTheLoadersOwn) {
  const json definitions = load_schema("config")["definitions"];
  const auto fallback = [&](const char* object, const char* key) {
    return definitions[object]["properties"][key]["default"];
  };
  const MeasureSpec measure;
  EXPECT_EQ(fallback("measure", "samples"), measure.samples);
  EXPECT_EQ(fallback("measure", "batch_ms"), measure.batch_ms);
  EXPECT_EQ(fallback("measure", "warmup_batches_max"), measure.warmup_batches_max);
  EXPECT_EQ(fallback("measure", "control_every"), measure.control_every);
  EXPECT_EQ(fallback("measure", "block_cases"), measure.block_cases);
  EXPECT_EQ(fallback("measure", "timeout_s"), measure.timeout_s);
  const Scene scene;
  EXPECT_EQ(fallback("scene", "relief_depth"), scene.relief_depth);
  EXPECT_EQ(fallback("scene", "tiling"), scene.tiling);
  EXPECT_EQ(fallback("scene", "frame_px"), (json{scene.width_px, scene.height_px}));
  EXPECT_EQ(fallback("light", "elevation_deg"), Light{}.elevation_deg);
  EXPECT_EQ(fallback("light", "azimuth_deg"), Light{}.azimuth_deg);
  EXPECT_EQ(fallback("light", "angular_radius_deg"), Light{}.angular_radius_deg);
  EXPECT_EQ(fallback("view", "elevation_deg"), View{}.elevation_deg);
  EXPECT_EQ(fallback("view", "distance"), View{}.distance);
  EXPECT_EQ(fallback("view", "fov_deg"), View{}.fov_deg);
  EXPECT_EQ(fallback("heightmap", "width"), HeightmapSpec{}.width);
  EXPECT_EQ(fallback("front", "error"), Config{}.front_error);
}

TEST(Schema, FrameSizesAreThoseOfTheTable) {
  const json names = load_schema("config")["definitions"]["scene"]["properties"]["frame_px"]["anyOf"][0]["enum"];
  json ids;
  for (const FrameSize& size : kFrameSizes) {
    ids.push_back(size.id);
    const json config = {{"scenes", {{{"heightmap", "rocks"}, {"views", "top"}, {"frame_px", size.id}}}},
                         {"sweeps", {{{"technique", "flat"}}}}};
    EXPECT_EQ(schema_errors(config, "config"), "");
    const Scene scene = parse_config(config.dump(), "c.json").scenes.front().scene;
    EXPECT_EQ(std::pair(scene.width_px, scene.height_px), std::pair(size.width_px, size.height_px));
  }
  EXPECT_EQ(names, ids);
}

TEST(Schema, ShippedConfigsAreValidAndMakeAPlan) {
  ASSERT_GE(shipped_configs().size(), 2U);
  const std::vector<std::string> backends{"opengl", "vulkan"};
  for (const auto& path : shipped_configs()) {
    const Config config = load_config(path);
    EXPECT_EQ(schema_errors(parsed(config.text), "config"), "") << path;
    const Plan plan = make_plan(config, backends, "");
    EXPECT_TRUE(plan.conflicts.empty()) << path << ": " << plan.conflicts[0];
  }
}

TEST(Schema, QuickstartAndSmokeHaveTheSizeTheyPromise) {
  const std::filesystem::path folder = std::filesystem::path(RELIEFBENCH_SOURCE_DIR) / "configs";
  const std::vector<std::string> both{"opengl", "vulkan"};
  const std::vector<std::string> one{"null"};
  EXPECT_EQ(make_plan(load_config(folder / "quickstart.json"), both, "").cases.size(), 63U * 3 * 2);
  EXPECT_EQ(make_plan(load_config(folder / "smoke.json"), one, "").cases.size(), 9U);
}

// What the loader refuses for its form, the schema refuses too; a name that only the registry knows passes.
TEST(Schema, RefusesBrokenConfigs) {
  const json good = {{"scenes", {{{"heightmap", "rocks"}, {"views", "top"}}}},
                     {"sweeps", {{{"technique", "relief"}, {"axes", {{"linear_steps", {8, 16}}}}}}}};
  ASSERT_EQ(schema_errors(good, "config"), "");
  const auto refused = [&](const char* pointer, const json& value) {
    json bad = good;
    bad[json::json_pointer(pointer)] = value;
    EXPECT_NE(schema_errors(bad, "config"), "") << bad;
    EXPECT_THROW((void)parse_config(bad.dump(), "c.json"), Error) << bad;
  };
  refused("/colour", 1);
  refused("/seed", -1);
  refused("/scenes", json::array());
  refused("/scenes/0/tiling", 0);
  refused("/scenes/0/relief_depth", -1);
  refused("/scenes/0/frame_px", {256});
  refused("/scenes/0/frame_px", "1081p");
  refused("/scenes/0/frame_px", {256, 16385});
  refused("/scenes/0/views", {{"id", "v"}, {"elevation_deg", -91}});
  refused("/measure", {{"samples", 0}});
  refused("/sweeps/0/axes/linear_steps", json::array());
  refused("/sweeps/0/axes/linear_steps", {{"from", 1}, {"to", 2}});
  refused("/sweeps/0/axes/linear_steps", 1.5);
  refused("/sweeps/0/where", {{"if", json::object()}});
  refused("/sweeps/0", {{"presets", 1}});
  refused("/sweeps/0", {{"presets", "p.json"}, {"quality", 101}});
  refused("/sweeps/0", {{"presets", "p.json"}, {"axes", json::object()}});
  refused("/budgets", {"e_xy.p99"});
}

json number_schema(const Metric& metric) {
  const bool may_be_null = metric.no_value != NoValue::never;
  json schema = {{"type", may_be_null ? json({"number", "null"}) : json("number")}};
  if (metric.low) schema["minimum"] = *metric.low;
  if (metric.high) schema["maximum"] = *metric.high;
  return schema;
}

/// What the registry makes of results.jsonl's "error".
json error_schema() {
  constexpr std::array kNulls{"", "; null: the pictures are identical", "; null or absent: not measured"};
  json properties = {{"pixels", {{"type", "integer"}, {"minimum", 0}, {"description", "with a ray"}}}};
  json required = {"pixels"};
  for (const Metric& metric : kMetrics) {
    const std::string id(metric.id);
    json schema = number_schema(metric);
    if (metric.aggregates.size() > 1) {
      schema = {{"type", "object"}, {"additionalProperties", false}, {"required", json::array()}};
      for (const Aggregate aggregate : metric.aggregates) {
        const std::string part(kAggregates.at(static_cast<std::size_t>(aggregate)).id);
        schema["required"].push_back(part);
        schema["properties"][part] = number_schema(metric);
      }
    }
    schema["description"] =
        fmt::format("{}: {}{}", metric.unit, metric.description, kNulls.at(static_cast<std::size_t>(metric.no_value)));
    properties[id] = schema;
    if (metric.no_value != NoValue::unmeasured) required.push_back(id);
  }
  return {{"type", "object"}, {"additionalProperties", false}, {"required", required}, {"properties", properties}};
}

TEST(Schema, ErrorsAreTheRegistrysMetrics) {
  EXPECT_EQ(load_schema("results")["definitions"]["error"], error_schema())
      << "the registry has changed: `definitions.error` of configs/schema/results.schema.json becomes\n"
      << error_schema().dump(2);
}

TEST(Schema, StatusesAreTheRecords) {
  std::set<std::string> ids;
  for (int status = 0; status <= static_cast<int>(Status::crashed); ++status)
    ids.emplace(status_id(static_cast<Status>(status)));
  EXPECT_EQ(load_schema("results")["properties"]["status"]["enum"].get<std::set<std::string>>(), ids);
}

TEST(Schema, RecordsAndSamplesAreValidLines) {
  const json whole = full_record();
  EXPECT_EQ(schema_errors(whole, "results"), "");
  EXPECT_EQ(keys_of(whole), keys_of(load_schema("results")["properties"]));
  for (const char* part : {"frame_time_ns", "error"})
    EXPECT_EQ(keys_of(whole[part]), keys_of(load_schema("results")["definitions"][part]["properties"])) << part;

  Record failed = full_record();
  failed.status = Status::timeout;
  failed.frame_time.reset();
  failed.error.reset();
  EXPECT_EQ(schema_errors(json(failed), "results"), "");
  Record identical = full_record();
  (*identical.error)["psnr"].reset();
  EXPECT_EQ(schema_errors(json(identical), "results"), "");

  json timeless = whole;
  timeless.erase("frame_time_ns");
  EXPECT_NE(schema_errors(timeless, "results"), "");
  json extra = whole;
  extra["colour"] = 1;
  EXPECT_NE(schema_errors(extra, "results"), "");
  const json schema = load_schema("results");
  for (const auto& id : schema["properties"]["status"]["enum"])
    EXPECT_EQ(status_id(parse_status(id.get<std::string>())), id);

  Sample sample{.case_id = "c", .round = 0, .frames = 4, .frame_time_ns = 2.5, .at_ns = 0};
  EXPECT_EQ(schema_errors(json(sample), "samples"), "");
  EXPECT_FALSE(json(sample).contains("part"));
  sample.part = 3;
  EXPECT_EQ(schema_errors(json(sample), "samples"), "");
  EXPECT_EQ(keys_of(json(sample)), keys_of(load_schema("samples")["properties"]));
  EXPECT_EQ(json(sample).get<Sample>().part, 3);
}

TEST(Schema, FrontsAreValid) {
  const std::vector<Record> records{full_record()};
  const std::vector<Front> all = fronts(records, "e_xy.p99", {});
  ASSERT_EQ(all.size(), 1U);
  EXPECT_EQ(schema_errors(fronts_json(all), "front"), "");
}

TEST(Schema, ARunThatWasJustStartedIsValid) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "schema_test_run";
  std::filesystem::remove_all(folder);
  const json device = {{"backend", "null"}, {"index", 0}, {"name", "n"}, {"driver", "d"}};
  const json identity = {
      {"schema", kSchemaVersion}, {"config_sha256", std::string(64, 'a')}, {"devices", {device}}, {"filter", ""}};
  { const RunStore store(folder, identity); }
  json info = load_run(folder).info;
  EXPECT_EQ(schema_errors(info, "run"), "");
  info["identity"]["schema"] = kSchemaVersion + 1;
  EXPECT_NE(schema_errors(info, "run"), "");
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace reliefbench
