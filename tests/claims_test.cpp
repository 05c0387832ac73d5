#include "tuner/measure/claims.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "kernels/base/error.h"
#include "tests/faulty_device.h"
#include "tests/made_claim.h"
#include "tests/technique_rig.h"
#include "tuner/plan/scene_key.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;

std::string claim_text(const std::string& check, const std::string& settings = "relief?linear_steps=8") {
  return R"({"source": "[X] table 1", "about": "a test",
"scene": {"heightmap": {"source": "spikes", "width": 16, "height": 16}, "views": "oblique", "frame_px": [16, 16]},
"metrics": ["e_xy.mean", "frame_time", "bake_time"],
"rows": [{"label": "few", "settings": ")" +
         settings + R"(", "paper": {"frame_time": 1}},
         {"label": "cones", "settings": "cone?cone_steps=64&filter=manual", "paper": {"frame_time": 2}}],
"checks": [)" +
         check + "]}";
}

constexpr const char* kLess = R"({"says": "s", "metric": "missed_rate", "of": "cones", "than": "few"})";
constexpr const char* kRatio =
    R"({"says": "s", "metric": "frame_time", "of": "cones", "to": "few", "quotient": 2, "tolerance": 0.1})";
constexpr const char* kBound = R"({"says": "s", "metric": "too_wide", "of": "cones", "at_most": 0})";

std::string claim_refusal(const std::string& text) {
  try {
    (void)parse_claim(text, "x.json");
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Exit::bad_input);
    return error.what();
  }
  return "no error";
}

TEST(Claims, TheBuiltInOnesAreRead) {
  std::set<std::string> ids;
  for (const Claim& claim : built_in_claims()) {
    EXPECT_TRUE(ids.insert(claim.id).second);
    EXPECT_FALSE(claim.checks.empty()) << claim.id;
  }
  EXPECT_THAT(ids, ::testing::ElementsAre("blocks", "bvbv24_table_1", "bvbv24_table_2", "engines", "gems3_18_1",
                                          "papers_beaten", "rtm_5_2", "rtm_5_4", "rtm_shadow", "vb22_generation",
                                          "vb22_render"));
}

TEST(Claims, RefusalsNameTheLineAndTheKey) {
  EXPECT_EQ(parse_claim(claim_text(kLess), "x.json").rows.size(), 2U);
  EXPECT_THAT(claim_refusal(claim_text(kLess, "bump?x=1")), HasSubstr("x.json:4"));
  EXPECT_THAT(claim_refusal(claim_text(kLess, "relief?cone_steps=1")), HasSubstr("cone_steps"));
  EXPECT_THAT(claim_refusal(claim_text(kLess, "cone?format=r8")), HasSubstr("r8"));
  EXPECT_THAT(claim_refusal(claim_text(R"({"says": "s", "metric": "beauty", "of": "few", "at_most": 1})")),
              HasSubstr("beauty"));
  EXPECT_THAT(claim_refusal(claim_text(R"({"says": "s", "metric": "psnr", "of": "many", "at_most": 1})")),
              HasSubstr("many"));
  EXPECT_THAT(claim_refusal(claim_text(R"({"says": "s", "metric": "psnr", "of": "few"})")),
              HasSubstr("expected one of"));
  EXPECT_THAT(
      claim_refusal(claim_text(R"({"says": "s", "metric": "psnr", "of": "few", "than": "cones", "at_most": 1})")),
      HasSubstr("expected one of"));
  EXPECT_THAT(claim_refusal(claim_text(R"({"says": "s", "metric": "psnr", "of": "few", "to": "cones"})")),
              HasSubstr("quotient"));
  EXPECT_THAT(claim_refusal(R"({"source": "s", "about": "a", "scenes": [], "metrics": [], "rows": [], "checks": []})"),
              HasSubstr("x.json:1"));
}

ClaimAnswer judged(const char* check, std::map<std::string, double> few, std::map<std::string, double> cones,
                   bool is_software) {
  const Claim claim = parse_claim(claim_text(check), "x.json");
  const std::vector<ClaimFigures> measured{{.values = std::move(few)}, {.values = std::move(cones)}};
  return judge_claim(claim, claim.checks[0], measured, is_software);
}

TEST(Claims, VerdictsFollowTheNumbers) {
  EXPECT_EQ(judged(kLess, {{"missed_rate", 0.2}}, {{"missed_rate", 0.1}}, true).verdict, ClaimVerdict::reproduced);
  EXPECT_EQ(judged(kLess, {{"missed_rate", 0.1}}, {{"missed_rate", 0.1}}, true).verdict, ClaimVerdict::not_reproduced);
  EXPECT_EQ(judged(kBound, {}, {{"too_wide", 0}}, true).verdict, ClaimVerdict::reproduced);
  EXPECT_EQ(judged(kBound, {}, {{"too_wide", 0.001}}, true).verdict, ClaimVerdict::not_reproduced);
  EXPECT_EQ(judged(kBound, {}, {}, true).verdict, ClaimVerdict::not_testable);
  EXPECT_EQ(judged(kRatio, {{"frame_time", 1}}, {{"frame_time", 2.1}}, false).verdict, ClaimVerdict::reproduced);
  EXPECT_EQ(judged(kRatio, {{"frame_time", 1}}, {{"frame_time", 2.3}}, false).verdict, ClaimVerdict::not_reproduced);
}

TEST(Claims, WhatIsSaidNeverToSkipIsGuaranteedTo) {
  int safe = 0;
  for (const Claim& claim : built_in_claims())
    for (const ClaimRow& row : claim.rows)
      if (row.label.starts_with("safe ")) {
        ++safe;
        EXPECT_NE(guarantee_of(row.settings), Guarantee::none) << row.label;
      }
  EXPECT_GT(safe, 30);
}

// Engines' defaults are held against what could ship: cone maps of as few steps, each setting in several scenes.
TEST(Claims, EnginesAreToldWithTheirSourcesAndInSeveralScenes) {
  const std::vector<Claim> claims = built_in_claims();
  const Claim& engines = *std::ranges::find(claims, "engines", &Claim::id);
  std::set<std::string> maps;
  std::set<std::string> views;
  for (const SceneSpec& scene : engines.scenes) {
    maps.emplace(heightmap_part(scene.id));
    views.emplace(view_part(scene.id));
  }
  EXPECT_GE(maps.size(), 3U);
  EXPECT_GE(views.size(), 2U);
  for (const ClaimRow& row : engines.rows) {
    const bool is_ours = row.label.find(": ") != std::string::npos;
    EXPECT_EQ(row.source.empty(), is_ours) << row.label;
    if (row.label.starts_with("cone maps")) EXPECT_LE(row.settings.get("cone_steps"), 32) << row.label;
    if (is_ours) continue;
    const auto check = std::ranges::find(engines.checks, row.label, &ClaimCheck::of);
    ASSERT_NE(check, engines.checks.end()) << row.label;
    EXPECT_EQ(check->says, "a tuned setting is faster than " + row.label + ", and no less accurate");
  }
  EXPECT_FALSE(engines.checks.back().rather_than.empty());
}

// A processor's frame times say nothing of a GPU's.
TEST(Claims, TimesOfASoftwareRasteriserDecideNothing) {
  const ClaimAnswer answer = judged(kRatio, {{"frame_time", 1}}, {{"frame_time", 2}}, true);
  EXPECT_EQ(answer.verdict, ClaimVerdict::not_testable);
  EXPECT_THAT(answer.numbers, HasSubstr("ours 2x, the paper's 2x"));
}

using ClaimsOnDevicesAudit = BackendTest;
INSTANTIATE_TEST_SUITE_P(AllBackends, ClaimsOnDevicesAudit, ::testing::Values("opengl", "vulkan"), backend_name);

TEST_P(ClaimsOnDevicesAudit, numbers_come_from_the_run) {
  std::vector<Claim> claims{parse_claim(claim_text(std::string(kLess) + "," + kRatio + "," + kBound), "x.json")};
  const std::vector<ClaimResult> results = run_claims(claims, {.backends = {std::string(row().id)}, .quiet = true});
  ASSERT_EQ(results.size(), 1U);
  const std::vector<ClaimFigures>& rows = results[0].scenes.at(0).rows;
  for (const ClaimFigures& figures : rows) {
    EXPECT_GT(figures.values.at("frame_time"), 0);
    EXPECT_EQ(figures.times_ns.size(), rows[0].times_ns.size());
  }
  EXPECT_EQ(rows[1].values.at("missed_rate"), 0);
  EXPECT_GT(rows[1].values.at("bake_time"), 0);
  EXPECT_EQ(results[0].answers[2].verdict, ClaimVerdict::reproduced);
  const nlohmann::json out = claims_json(results);
  EXPECT_EQ(out[0]["checks"].size(), 3U);
  EXPECT_EQ(out[0]["rows"][0]["paper"]["frame_time"], 1);
}

constexpr const char* kNoBaker = "distance";
constexpr const char* kBakeBound = R"({"says": "s", "metric": "bake_time", "of": "cones", "at_most": 3})";
constexpr const char* kBakeLess = R"({"says": "s", "metric": "bake_time", "of": "cones", "than": "few"})";

std::vector<ClaimResult> claims_run_on(FaultyDevices& devices, std::span<const Claim> claims,
                                       const std::string& backend) {
  return run_claims(claims, {.backends = {backend}, .quiet = true, .open = devices.opener(), .cooling_pause_s = 0});
}

TEST_P(ClaimsOnDevicesAudit, hardware_bakes_what_is_timed_by_itself) {
  const std::string checks = std::string(kBakeBound) + "," + kBakeLess + "," + kBound;
  const std::vector<Claim> claims{parse_claim(claim_text(checks, kNoBaker), "x.json")};
  FaultyDevices software;
  const std::vector<ClaimResult> by_cpu = claims_run_on(software, claims, std::string(row().id));
  EXPECT_EQ(software.calls(FaultyDevices::compute), 0);
  for (const ClaimFigures& figures : by_cpu[0].scenes[0].rows) EXPECT_GT(figures.values.at("bake_time"), 0);

  FaultyDevices hardware;
  hardware.be_hardware();
  hardware.tell_times([](int nth) {  // the first warms up
    return std::vector<ComputeTime>{{.part = "upload", .ns = 50e6},
                                    {.part = "search", .ns = nth == 0 ? 1e9 : nth * 1e6 - 0.5e6},
                                    {.part = "pack", .ns = 0.5e6},
                                    {.part = "read_back", .ns = 70e6}};
  });
  const std::vector<ClaimResult> results = claims_run_on(hardware, claims, std::string(row().id));
  EXPECT_TRUE(hardware.had_compute_audit());
  EXPECT_EQ(hardware.calls(FaultyDevices::compute), 7);  // the last one for the values
  const std::vector<ClaimFigures>& rows = results[0].scenes[0].rows;
  EXPECT_DOUBLE_EQ(rows[1].values.at("bake_time"), 3);
  EXPECT_FALSE(rows[0].values.contains("bake_time"));
  EXPECT_EQ(rows[0].values.at("e_xy.mean"), by_cpu[0].scenes[0].rows[0].values.at("e_xy.mean"));
  const std::vector<ClaimAnswer>& answers = results[0].answers;
  EXPECT_EQ(answers[0].verdict, ClaimVerdict::reproduced);
  EXPECT_EQ(answers[1].verdict, ClaimVerdict::not_testable);
  EXPECT_EQ(answers[1].numbers, "few has no bake_time: no GPU baker for distance");
  EXPECT_EQ(answers[2].verdict, ClaimVerdict::reproduced);

  hardware.tell_times([](int) { return std::vector<ComputeTime>(); });  // it has no clock
  EXPECT_GT(claims_run_on(hardware, claims, std::string(row().id))[0].scenes[0].rows[1].values.at("bake_time"), 0);
}

TEST(Claims, HardwareWithoutComputeHasNoBakeTimes) {
  const std::vector<Claim> claims{parse_claim(claim_text(kBakeBound), "x.json")};
  FaultyDevices hardware;
  hardware.be_hardware();
  const std::vector<ClaimAnswer> answers = claims_run_on(hardware, claims, "null")[0].answers;
  EXPECT_EQ(answers[0].verdict, ClaimVerdict::not_testable);
  EXPECT_THAT(answers[0].numbers, HasSubstr("cones has no bake_time: null: no compute"));
}

TEST(Claims, HardwareDrawsThePapersSizes) {
  const std::vector<Claim> small{parse_claim(made_claim(), "x.json")};
  FaultyDevices devices;
  const auto devices_told = [&] { return std::vector{devices.opener()(find_backend("null"), 0)->device()}; };
  std::vector<Claim> claims = small;
  EXPECT_EQ(set_sizes(claims, devices_told(), std::nullopt), "");
  EXPECT_EQ(set_sizes(claims, {}, std::nullopt), "");
  EXPECT_EQ(claims[0].scenes[0].id, "spikes_16x16/oblique");
  EXPECT_EQ(claims[0].scenes[0].heightmap.width, 16);
  EXPECT_EQ(claims[0].scenes[0].scene.width_px, 16);

  devices.be_hardware();
  EXPECT_THAT(set_sizes(claims, devices_told(), std::nullopt),
              ::testing::AllOf(HasSubstr("frames are 1920x1080"), HasSubstr("null (null) is hardware"),
                               HasSubstr("heightmaps are 512x512 at least"), HasSubstr("--quick")));
  EXPECT_EQ(claims[0].scenes[0].scene.width_px, 1920);
  claims = small;
  EXPECT_EQ(set_sizes(claims, devices_told(), Size{24, 8}),
            "procedural heightmaps are 512x512 at least on hardware; --quick draws the claims' own");
  const nlohmann::json out = claims_json(claims_run_on(devices, claims, "null"));
  EXPECT_EQ(out[0]["rows"][0]["scene"], "spikes_512x512/oblique");
  EXPECT_EQ(out[0]["rows"][0]["map_px"], (nlohmann::json{512, 512}));
  EXPECT_EQ(out[0]["rows"][0]["frame_px"], (nlohmann::json{24, 8}));
}

// Maps as they are stored, in several scenes: verified, and compared with another storage in each.
std::string stored_claim(const std::string& rows, const std::string& checks) {
  return R"({"source": "s", "about": "a",
"scenes": [{"heightmap": {"source": "spikes", "width": 16, "height": 16}, "views": ["oblique", "grazing"],
            "frame_px": [16, 16]},
           {"heightmap": {"source": "fbm", "width": 16, "height": 16}, "views": "oblique", "frame_px": [16, 16]}],
"metrics": ["violations", "undecided", "taps.mean"],
"rows": [)" +
         rows + "], \"checks\": [" + checks + "]}";
}
constexpr const char* kStoredRows = R"(
{"label": "BC5", "settings": "cone?cone_steps=64&correction=safe&step=plain&format=bc5"},
{"label": "rg8", "settings": "cone?cone_steps=64&correction=safe&step=plain&format=rg8"},
{"label": "wide", "settings": "cone?cone_steps=64&correction=none&step=plain&format=rg8"},
{"label": "heights", "settings": "relief?linear_steps=8"})";

TEST(Claims, MapsAreVerifiedAsTheyAreStored) {
  const Claim claim = parse_claim(stored_claim(kStoredRows, R"(
{"says": "safe", "metric": "violations", "of": "BC5", "at_most": 0},
{"says": "proved", "metric": "undecided", "of": "BC5", "at_most": 0},
{"says": "not safe", "metric": "violations", "of": "wide", "at_most": 0},
{"says": "no cones", "metric": "violations", "of": "heights", "at_most": 0},
{"says": "steps", "metric": "taps.mean", "of": "BC5", "to": "rg8", "at_most": 1e9},
{"says": "no fewer", "metric": "taps.mean", "of": "BC5", "to": "rg8", "at_most": 1e-9})"),
                                  "x.json");
  const std::vector<Claim> claims{claim};
  FaultyDevices devices;
  const std::vector<ClaimResult> results = claims_run_on(devices, claims, "opengl");
  ASSERT_EQ(results[0].scenes.size(), 3U);
  const std::vector<ClaimAnswer>& answers = results[0].answers;
  EXPECT_EQ(answers[0].verdict, ClaimVerdict::reproduced);
  EXPECT_EQ(answers[0].numbers, "at most 0, so in 3 of 3 scenes");
  EXPECT_EQ(answers[0].table,
            (std::vector<std::vector<std::string>>{
                {"violations", "oblique", "grazing"}, {"spikes_16x16", "0", "0"}, {"fbm_16x16", "0"}}));
  EXPECT_EQ(answers[1].verdict, ClaimVerdict::reproduced);
  EXPECT_EQ(answers[2].verdict, ClaimVerdict::not_reproduced);
  EXPECT_EQ(answers[3].verdict, ClaimVerdict::not_testable);
  EXPECT_EQ(answers[3].table[1][1], "-");
  EXPECT_EQ(answers[4].verdict, ClaimVerdict::reproduced);
  EXPECT_EQ(answers[5].verdict, ClaimVerdict::not_reproduced);
  const auto& rows = results[0].scenes[1].rows;
  const double bc5 = rows[0].values.at("taps.mean");
  const double rg8 = rows[1].values.at("taps.mean");
  EXPECT_EQ(answers[4].table[1][2], fmt::format("{:.4g} against {:.4g}, {:.2f}x", bc5, rg8, bc5 / rg8));
}

TEST(Claims, OneOfSeveralScenesHoldsWhereItHoldsInEach) {
  const Claim claim = parse_claim(
      stored_claim(kStoredRows, R"({"says": "s", "metric": "taps.mean", "of": "BC5", "to": "rg8", "at_most": 1.1})"),
      "x.json");
  const auto judged_in = [&](const std::vector<std::optional<double>>& taps) {
    std::vector<SceneFigures> scenes;
    scenes.reserve(taps.size());
    for (std::size_t i = 0; i < taps.size(); ++i) {
      SceneFigures& scene = scenes.emplace_back();
      scene.scene = &claim.scenes[i];
      scene.rows.resize(claim.rows.size());
      if (taps[i]) scene.rows[0].values["taps.mean"] = *taps[i];
      scene.rows[1].values["taps.mean"] = 10;
    }
    return judge_in_each(claim, claim.checks[0], scenes, true);
  };
  EXPECT_EQ(judged_in({11, 9, 10}).verdict, ClaimVerdict::reproduced);
  EXPECT_EQ(judged_in({11, 12, 10}).verdict, ClaimVerdict::not_reproduced);
  EXPECT_EQ(judged_in({11, 12, 10}).numbers, "at most 1.1x, so in 2 of 3 scenes");
  EXPECT_EQ(judged_in({11, std::nullopt, 10}).verdict, ClaimVerdict::not_testable);
  EXPECT_EQ(judged_in({12, std::nullopt, 10}).verdict, ClaimVerdict::not_reproduced);
  EXPECT_EQ(judged_in({9}).numbers, "9 against 10, 0.9x; at most 1.1x");
}

constexpr const char* kThreeScenes = R"({"source": "s", "about": "a",
"scenes": [{"heightmap": {"source": "spikes", "width": 16, "height": 16}, "views": ["top", "oblique", "grazing"],
            "frame_px": [16, 16]}],
"metrics": ["e_xy.p99"],
"rows": [{"label": "few", "settings": "relief?linear_steps=8", "source": "an engine"},
         {"label": "more", "settings": "relief?linear_steps=9"}],
"checks": [{"says": "{}", "metric": "e_xy.p99", "of_each": ["few"], "beaten_by": ["more"]}]})";

TEST(Claims, AnInterruptedRunAnswersOfTheScenesThatItDrew) {
  const std::vector<Claim> claims{parse_claim(kThreeScenes, "x.json")};
  const auto run_until = [&](int asked_most) {
    return run_claims(claims, {.backends = {"null"},
                               .quiet = true,
                               .is_interrupted = [asked_most, asked = 0]() mutable { return ++asked > asked_most; }});
  };
  const std::vector<ClaimResult> whole = run_until(1000);
  EXPECT_EQ(whole[0].scenes.size(), 3U);
  EXPECT_EQ(whole[0].undone, 0);
  const nlohmann::json told = claims_json(whole);
  EXPECT_FALSE(told[0].contains("undone"));
  EXPECT_EQ(told[0]["rows"][0]["source"], "an engine");
  EXPECT_FALSE(told[0]["rows"][1].contains("source"));

  // Asked once before it measures the device, then thrice a scene: of the second one a row is left out.
  const std::vector<ClaimResult> some = run_until(1 + 3 + 2);
  ASSERT_EQ(some[0].scenes.size(), 1U);
  EXPECT_EQ(some[0].undone, 2);
  EXPECT_THAT(some[0].answers[0].numbers, HasSubstr("in 1 scene"));
  EXPECT_EQ(claims_json(some)[0]["undone"], 2);

  const std::vector<ClaimResult> none = run_until(0);
  EXPECT_EQ(none[0].undone, 3);
  EXPECT_EQ(none[0].answers[0].verdict, ClaimVerdict::not_testable);
  EXPECT_EQ(none[0].answers[0].numbers, "interrupted before a scene was drawn");
}

TEST(Claims, OneThatIsKnownToFailSaysWhy) {
  const auto check = [](double bound) {
    return fmt::format(R"(, {{"says": "s", "metric": "missed_rate", "of": "cones", "at_most": {}, "why": "so it is"}})",
                       bound);
  };
  const std::vector<Claim> claims{parse_claim(made_claim(check(-1) + check(1)), "x.json")};
  FaultyDevices devices;
  const std::vector<ClaimAnswer> answers = claims_run_on(devices, claims, "null")[0].answers;
  EXPECT_EQ(answers[2].verdict, ClaimVerdict::not_reproduced);
  EXPECT_THAT(answers[2].numbers, ::testing::EndsWith(", at most -1; so it is"));
  EXPECT_EQ(answers[3].verdict, ClaimVerdict::reproduced);
  EXPECT_THAT(answers[3].numbers, ::testing::EndsWith(", at most 1"));
}

}  // namespace
}  // namespace reliefbench
