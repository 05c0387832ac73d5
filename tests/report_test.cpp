#include "reports/pages/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <regex>

#include "kernels/base/append_file.h"
#include "kernels/base/atomic_file.h"
#include "kernels/base/error.h"
#include "kernels/image/image.h"
#include "reports/pages/assets.h"
#include "reports/pages/data_uri.h"
#include "reports/pages/fleet_data.h"
#include "reports/pages/report_data.h"
#include "tests/finished_run.h"
#include "tests/hand_made_stress.h"
#include "tests/synthetic_run.h"
#include "tuner/decide/fleet.h"
#include "tuner/decide/pareto.h"
#include "tuner/plan/setting_names.h"
#include "tuner/results/case_table.h"
#include "tuner/results/run_files.h"
#include "tuner/results/run_question.h"

namespace reliefbench {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

json page_data(const std::string& html) {
  constexpr std::string_view kOpen = R"(<script type="application/json" id="data">)";
  const std::size_t open = html.find(kOpen);
  EXPECT_NE(open, std::string::npos);
  const std::size_t begin = open + kOpen.size();
  return json::parse(html.substr(begin, html.find("</script>", begin) - begin));
}

json data_of(const Run& run) { return report_data(std::span(&run, 1)).data; }
std::string page_of(const Run& run) { return make_report(std::span(&run, 1)); }

std::size_t metric_index(std::string_view id) { return static_cast<std::size_t>(&find_metric(id) - metrics().data()); }

std::filesystem::path fresh_folder(const std::string& name) {
  std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / ("report_test_" + name);
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  return folder;
}

TEST(Report, DataSurvivesHostileTexts) {
  const auto run = synthetic_run({});
  const std::string html = page_of(run);
  const json data = page_data(html);
  EXPECT_EQ(data, data_of(run));
  const json& statuses = data["runs"][0]["statuses"];
  EXPECT_TRUE(std::any_of(statuses.begin(), statuses.end(), [](const json& row) {
    return row["reason"].get<std::string>().find(kHostileText) != std::string::npos;
  }));
  EXPECT_THAT(html, Not(HasSubstr("<script>alert")));
  EXPECT_THAT(html, Not(HasSubstr("<!-- '")));
  EXPECT_THAT(html, Not(HasSubstr("{{")));
}

TEST(Report, TextsThatAreNotUtf8DoNotStopIt) {
  auto run = synthetic_run({.cases = 2});
  run.records.front().case_id += "\xff\xfe";
  EXPECT_EQ(page_data(page_of(run))["points"].size(), 12u);
}

TEST(Report, LoadsNothing) {
  std::string html = page_of(synthetic_run({}));
  EXPECT_THAT(html,
              HasSubstr("default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'"));
  for (const char* loader :
       {R"((src|href|srcset|action|poster|data)\s*=\s*["']?\s*(https?:|//))", R"(url\(\s*["']?(https?:|//))"})
    EXPECT_FALSE(std::regex_search(html, std::regex(loader))) << loader;
  EXPECT_THAT(html, Not(HasSubstr("@import")));
}

TEST(Report, AssetsCanStandInsideAPage) {
  for (const EmbeddedFile& asset : embedded_assets()) {
    if (asset.name.ends_with(".html")) continue;
    EXPECT_THAT(std::string(asset.text), Not(HasSubstr("</script"))) << asset.name;
    EXPECT_THAT(std::string(asset.text), Not(HasSubstr("</style"))) << asset.name;
    if (asset.name == "chart.min.js") continue;
    // The one address is the name of SVG's namespace, which nothing loads.
    const std::string own = std::regex_replace(std::string(asset.text), std::regex("http://www.w3.org/2000/svg"), "");
    EXPECT_THAT(own, Not(HasSubstr("http"))) << asset.name;
  }
}

TEST(Report, KeepsExactPointsAndIdenticalPictures) {
  const auto run = synthetic_run({});
  const json data = data_of(run);
  const auto exact = std::count_if(run.records.begin(), run.records.end(), [](const Record& record) {
    return record.error && record.error->at("e_xy.p99") == 0;
  });
  ASSERT_GT(exact, 0);
  const auto count = [&](std::size_t metric, const json& value) {
    return std::count_if(data["points"].begin(), data["points"].end(),
                         [&](const json& point) { return point["errors"][metric] == value; });
  };
  EXPECT_EQ(count(metric_index("e_xy.p99"), 0.0), exact);
  EXPECT_EQ(count(metric_index("psnr"), nullptr), exact);
}

// Their ids come with the data: one that a script quotes is one that nobody keeps in step.
TEST(Report, ScriptsQuoteNoMetric) {
  for (const auto& file : std::filesystem::directory_iterator(RELIEFBENCH_SOURCE_DIR "/reports/assets")) {
    if (file.path().extension() != ".js") continue;
    const std::string script = read_file(file.path());
    for (const Metric& metric : kMetrics)
      for (const std::string& quoted : {fmt::format("'{}'", metric.id), fmt::format("'{}.", metric.id)})
        if (quoted != "'taps'") {  // which is a kind of picture, too
          EXPECT_EQ(script.find(quoted), std::string::npos) << file.path() << " quotes " << metric.id;
        }
  }
}

TEST(Report, CountsEveryStatusOnce) {
  const auto run = synthetic_run({});
  const json data = data_of(run);
  std::size_t sum = 0;
  std::vector<std::string> seen;
  for (const json& row : data["runs"][0]["statuses"]) {
    sum += row["count"].get<std::size_t>();
    seen.push_back(row["status"]);
  }
  EXPECT_EQ(sum, run.records.size());
  for (const char* id : {"ok", "unsupported", "compile_error", "timeout", "device_lost", "out_of_memory",
                         "invalid_timer", "throttled", "crashed"})
    EXPECT_THAT(seen, testing::Contains(id));
}

TEST(Report, PutsInThePicturesThatAreThere) {
  const std::filesystem::path folder = fresh_folder("pictures");
  const auto run = synthetic_run({.folder = folder, .scenes = {"rocks/oblique"}});
  EXPECT_TRUE(report_data(std::span(&run, 1)).images.empty());

  std::filesystem::create_directories(folder / "images");
  const Record& record = run.records.front();
  std::ofstream(folder / image_path(record.case_id, "error")) << "foobar";
  const std::vector<std::uint8_t> white(std::size_t{4 * 8 * 8}, 255);
  write_png(folder / image_path(record.case_id, "frame"), 8, 8, white);
  std::ofstream(folder / "outside.png") << "foobar";
  std::filesystem::create_symlink("/etc/hostname", folder / image_path(record.case_id, "taps"));
  const ReportData with = report_data(std::span(&run, 1));
  const json& pictures = with.data["points"][0]["pictures"];
  EXPECT_TRUE(pictures["reference"].is_null());
  EXPECT_THAT(with.images[pictures["frame"].get<std::size_t>()], testing::StartsWith("data:image/webp;base64,"));
  EXPECT_EQ(with.images[pictures["error"].get<std::size_t>()], "data:image/png;base64,Zm9vYmFy");
  EXPECT_EQ(with.images[pictures["taps"].get<std::size_t>()], "");  // a link to the outside
  EXPECT_FALSE(with.data["points"][1].contains("pictures"));
}

// A page of several devices has each picture once.
TEST(Report, PicturesOfASettingInASceneAreThoseOfTheFirstDevice) {
  const std::filesystem::path folder = fresh_folder("first_device");
  const auto run = synthetic_run({.folder = folder, .scenes = {"rocks/oblique"}, .cases = 1});
  std::filesystem::create_directories(folder / "images");
  for (const Record& record : run.records)
    if (record.status == Status::ok) std::ofstream(folder / image_path(record.case_id, "error")) << "foobar";
  const ReportData made = report_data(std::span(&run, 1));
  ASSERT_EQ(made.data["points"].size(), 2U);
  EXPECT_EQ(made.data["points"][0]["setting"], made.data["points"][1]["setting"]);
  EXPECT_TRUE(made.data["points"][0].contains("pictures"));
  EXPECT_FALSE(made.data["points"][1].contains("pictures"));
  EXPECT_EQ(made.images.size(), 1U);
}

TEST(Report, ScenesTellWhatATexelIsOnTheScreen) {
  auto run = synthetic_run({.scenes = {"rocks/oblique"}, .cases = 2});
  EXPECT_TRUE(data_of(run)["scenes"][0]["texel_px"].is_null());  // of a run of before its map's size was written
  run.scenes[0].map_width = 512;
  run.scenes[0].map_height = 256;
  // A texel of 1/256, looked at from 30 degrees at a distance of 1.5, of which 45 degrees are 256 pixels.
  const double expected = 256 / (2 * std::tan(std::numbers::pi / 8) * 1.5) * 0.5 / 256;
  EXPECT_NEAR(data_of(run)["scenes"][0]["texel_px"].get<double>(), expected, 1e-9);
}

TEST(Report, OneSettingForAllPlacesIsWhatChooseSays) {
  const TempFolder folder;
  const reliefbench::Run run = load_run(null_sweep(folder, R"("oblique", "grazing")"));
  const json fleet = data_of(run)["fleet"];
  const FleetOptions options{.budgets = question_of(run).budgets};
  const std::vector<FleetRun> runs = {{.name = run.folder.string(), .rows = case_table(run)}};
  try {
    const Fleet expected = choose_for_fleet(runs, options);
    ASSERT_FALSE(fleet.contains("refusal")) << fleet;
    EXPECT_EQ(fleet["settings"][0]["key"], setting_key(expected.settings.front().settings));
    EXPECT_EQ(fleet["places"].size(), 2U);
    EXPECT_LE(fleet["settings"].size(), kFleetSettings);
  } catch (const Error& error) {
    EXPECT_EQ(fleet["refusal"], error.what());
  }
  EXPECT_TRUE(data_of(synthetic_run({.backends = {"null"}, .scenes = {"a/top"}, .cases = 2}))["fleet"].is_null());
}

TEST(Report, TellsDevicesOfSeveralRunsApart) {
  const std::vector<reliefbench::Run> runs = {synthetic_run({.folder = "out/a", .device = "A", .cases = 5}),
                                              synthetic_run({.folder = "out/b", .device = "B", .cases = 5}),
                                              synthetic_run({.folder = "out/c", .device = "B", .cases = 5})};
  const json data = report_data(runs).data;
  std::vector<std::string> labels;
  for (const json& group : data["groups"]) labels.push_back(group["label"]);
  EXPECT_THAT(labels, testing::ElementsAre("A (opengl)", "A (vulkan)", "B (opengl), out/b", "B (vulkan), out/b",
                                           "B (opengl), out/c", "B (vulkan), out/c"));
  EXPECT_EQ(data["scenes"].size(), 3u);
  EXPECT_EQ(data["points"].size(), 3u * 2 * 3 * 5);
}

TEST(Report, SaysWhereNothingWasMeasured) {
  EXPECT_THROW((void)make_report({}), Error);
  auto run = synthetic_run({});
  std::erase_if(run.records, [](const Record& record) { return record.status == Status::ok; });
  EXPECT_EQ(data_of(run)["points"].size(), 0u);
  run.records.clear();
  try {
    (void)page_of(run);
    FAIL() << "a run without records made a page";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Exit::nothing_measured);
  }
}

TEST(Report, ReadsRunsAndWritesOneFile) {
  const std::filesystem::path folder = fresh_folder("write");
  const auto run = synthetic_run({.folder = folder / "run", .cases = 5});
  {
    RunStore store(run.folder, run.info["identity"]);
    store.write_info(run.info);
    for (const Record& record : run.records) store.append(record);
  }
  const std::vector<std::filesystem::path> folders = {run.folder};
  write_report(folders, folder / "report.html");
  EXPECT_EQ(page_data(read_file(folder / "report.html"))["points"].size(), 2u * 3 * 5);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}),
            2);  // the run and the page, nothing half-written
  const std::vector<std::filesystem::path> none = {folder / "no_such_run"};
  EXPECT_THROW(write_report(none, folder / "other.html"), Error);
  EXPECT_FALSE(std::filesystem::exists(folder / "other.html"));
}

TEST(Report, HoldsTheMatrixOfStress) {
  const std::filesystem::path stress = write_hand_made_stress(fresh_folder("stress"));
  const auto run = synthetic_run({.cases = 2});
  const json data = page_data(make_report(std::span(&run, 1), stress));
  EXPECT_EQ(data["stress"], load_stress(stress));
  EXPECT_THAT(data["stress"]["pictures"]["cone"].get<std::string>(), testing::StartsWith("data:image/png;base64,"));
  EXPECT_FALSE(page_data(page_of(run)).contains("stress"));
}

// A folder from elsewhere may name what it likes: no picture from outside of it gets into a page.
TEST(Report, TakesNoPictureFromOutsideOfItsFolder) {
  const std::filesystem::path root = fresh_folder("confined");
  const std::filesystem::path stress = write_hand_made_stress(root / "stress");
  std::filesystem::copy(stress / "images/cone.png", root / "mine.png");
  const std::string text = read_file(stress / kStressFile);
  const auto pictures_with = [&](const std::string& technique) {
    json doctored = json::parse(text);
    for (json& worst : doctored["worst"]) worst["technique"] = technique;
    write_atomically(stress / kStressFile, doctored.dump());
    return load_stress(stress)["pictures"][technique];
  };
  EXPECT_TRUE(pictures_with("cone").is_string());
  EXPECT_TRUE(pictures_with("../../mine").is_null());
  EXPECT_TRUE(pictures_with((root / "mine").string()).is_null());
  std::filesystem::create_symlink(root / "mine.png", stress / "images/link.png");
  EXPECT_TRUE(pictures_with("link").is_null());
}

std::string stress_refusal(const std::filesystem::path& folder) {
  const auto run = synthetic_run({.cases = 2});
  try {
    (void)make_report(std::span(&run, 1), folder);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Exit::bad_input);
    return error.what();
  }
  return "no error";
}

TEST(Report, RefusesStressThatIsTornOrOfAnotherSchema) {
  const std::filesystem::path folder = write_hand_made_stress(fresh_folder("torn"));
  const std::filesystem::path path = folder / kStressFile;
  const auto refused_as = [&](const std::string& text) {
    std::ofstream(path) << text;
    return stress_refusal(folder);
  };
  const std::string whole = read_file(path);
  EXPECT_EQ(refused_as(whole), "no error");
  EXPECT_EQ(refused_as(whole.substr(0, whole.size() / 2)), path.string() + ": torn, or not JSON");
  EXPECT_EQ(refused_as(R"({"schema": 99})"), path.string() + ": key 'schema': is 99, this reliefbench reads 1");
  EXPECT_EQ(refused_as("[]"), path.string() + ": key 'schema': is missing, this reliefbench reads 1");
  EXPECT_THAT(refused_as(R"({"schema": 1})"), HasSubstr("'worst' not found"));
  std::filesystem::remove(path);
  EXPECT_THAT(stress_refusal(folder), HasSubstr(path.string()));
}

TEST(Report, WritesTheStressPageAgain) {
  const std::filesystem::path folder = write_hand_made_stress(fresh_folder("again"));
  EXPECT_TRUE(is_stress_folder(folder));
  write_stress_page(folder, folder / "again.html");
  EXPECT_EQ(read_file(folder / "again.html"), read_file(folder / kStressPage));
  std::ofstream(folder / kRunFile) << "{}";
  EXPECT_FALSE(is_stress_folder(folder));
}

TEST(Base64, VectorsOfRfc4648) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64("\xff\xfe\xfd"), "//79");
}

}  // namespace
}  // namespace reliefbench
