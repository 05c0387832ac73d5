// Errors that a device's coarse sampler made are marked, in the table, on the pages and at every pick.
#include "tuner/results/coarse_filter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "kernels/base/append_file.h"
#include "reports/pages/report_data.h"
#include "tests/command.h"
#include "tests/finished_run.h"
#include "tests/schema.h"
#include "tests/written_run.h"
#include "tests/written_tables.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/case_table.h"
#include "tuner/results/run_files.h"
#include "tuner/tune/tune.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;

/// The audit of a device that filters 8-bit texels as llvmpipe does, and others as a GPU.
nlohmann::json llvmpipes_filter() {
  const auto row = [](std::string_view texels, double worst) {
    return nlohmann::json{{"texels", texels}, {"bits", 8},         {"rounds", true},
                          {"least", -worst},  {"greatest", worst}, {"value", 0}};
  };
  return {row("unorm8", 0.0039), row("unorm16", 0.00196)};
}

nlohmann::json info_of(const nlohmann::json& filter) {
  return {{"devices", {{{"backend", "opengl"}, {"name", "llvmpipe"}, {"filter", filter}}}}};
}

TEST(CoarseFilter, is_seen_by_settings_that_read_such_texels_with_it) {
  const CoarseFilter filter(info_of(llvmpipes_filter()), "opengl");
  EXPECT_TRUE(filter.made_error_of(parse_setting("cone?format=rg8")));
  EXPECT_TRUE(filter.made_error_of(parse_setting("relief")));  // r8
  EXPECT_FALSE(filter.made_error_of(parse_setting("cone?format=rg8&filter=manual")));
  EXPECT_FALSE(filter.made_error_of(parse_setting("cone?format=rg16")));
  EXPECT_FALSE(filter.made_error_of(parse_setting("flat")));
  EXPECT_FALSE(filter.made_error_of(parse_setting("max_mip?format=r8")));  // has no filter
  EXPECT_EQ(filter.mark("relief@rocks/grazing?format=r8&backend=opengl"), CoarseFilter::kMark);
  EXPECT_THAT(filter.note(), HasSubstr("llvmpipe"));
  EXPECT_THAT(filter.note(), HasSubstr("unorm8 texels"));
  EXPECT_THAT(filter.note(), HasSubstr("0.0039"));
}

TEST(CoarseFilter, is_none_where_nothing_is_known_of_it) {
  for (const CoarseFilter& filter :
       {CoarseFilter(), CoarseFilter(info_of(llvmpipes_filter()), "vulkan"),
        CoarseFilter(info_of(nlohmann::json::array()), "opengl"), CoarseFilter(nlohmann::json::object(), "opengl")}) {
    EXPECT_EQ(filter.note(), "");
    EXPECT_EQ(filter.mark("relief"), "");
  }
}

/// Whether settings read texels of 8 bits with the device's filter.
bool reads_8_bits(const Settings& settings) {
  return settings.technique().reads_map() && storage_of(settings).format.type == TexelType::unorm8 &&
         settings.is("filter", "hardware");
}

/// A sweep on the null backend, whose device then says that it filters coarsely.
class CoarselyFilteredRun : public ::testing::Test {
 protected:
  void SetUp() override {
    run_ = null_sweep(folder_);
    nlohmann::json info = nlohmann::json::parse(read_file(run_ / kRunFile));
    info["devices"][0]["filter"] = llvmpipes_filter();
    EXPECT_EQ(schema_errors(info, "run"), "");
    std::ofstream(run_ / kRunFile) << info.dump(1);
  }
  /// Leaves in the run only what is marked, so that every pick is.
  void keep_marked() const {
    reliefbench::Run run = load_run(run_);
    std::erase_if(run.records, [](const Record& record) { return !reads_8_bits(parse_setting(record.case_id)); });
    write_run(run);
  }
  /// What is marked, as the table of such a device: where it filters as a GPU does, of the same settings.
  std::string marked_table(const std::string& device, bool is_coarse) const {
    std::vector<TableRow> rows = case_table(load_run(run_));
    std::erase_if(rows, [](const TableRow& row) { return row.coarse_filter <= 0; });
    for (TableRow& row : rows) {
      row.device = device;
      if (!is_coarse) row.coarse_filter = 0;
    }
    const std::string path = (folder_ / (device + ".csv")).string();
    std::ofstream(path) << case_table_csv(rows);
    return path;
  }
  CommandResult ask(const std::vector<std::string>& words) const { return run_reliefbench(words, folder_.path()); }

  TempFolder folder_;
  std::filesystem::path run_;
};

TEST_F(CoarselyFilteredRun, is_marked_at_the_pick) {
  const CommandResult pick = run_reliefbench({"recommend", run_, "--max-time-ms", "1000"}, folder_.path());
  EXPECT_THAT(pick.out, HasSubstr(" *\n"));
  EXPECT_THAT(pick.out, HasSubstr("* filter=hardware on null (null), whose"));
  const CommandResult json = run_reliefbench({"recommend", run_, "--json", "--max-time-ms", "1000"}, folder_.path());
  EXPECT_THAT(nlohmann::json::parse(json.out).at("answers").at(0).at("filter_note").get<std::string>(),
              HasSubstr("expect less error on a GPU"));
}

TEST_F(CoarselyFilteredRun, is_marked_on_the_page) {
  const reliefbench::Run run = load_run(run_);
  const nlohmann::json data = report_data(std::span(&run, 1)).data;
  EXPECT_EQ(data.at("runs").at(0).at("filter_notes").size(), 1U);
  int marked = 0;
  for (const nlohmann::json& point : data.at("points")) {
    const Settings settings = parse_setting(point.at("id").get<std::string>());
    EXPECT_EQ(point.at("mark") == CoarseFilter::kMark, reads_8_bits(settings));
    marked += point.at("mark") == "" ? 0 : 1;
  }
  EXPECT_GT(marked, 0);
}

TEST_F(CoarselyFilteredRun, is_marked_by_a_search_of_it) {
  TuneOptions options;
  options.quiet = true;
  const nlohmann::json found = tune_json(replay_tune(run_, "", options));
  EXPECT_EQ(schema_errors(found, "tune"), "");
  EXPECT_THAT(found.at("filter").at("note").get<std::string>(), HasSubstr("unorm8"));
  EXPECT_GT(found.at("filter").at("marked").size(), 0U);
  EXPECT_LT(found.at("filter").at("marked").size(), found.at("settings").size());
}

TEST_F(CoarselyFilteredRun, is_marked_in_the_table) {
  const std::vector<TableRow> rows = case_table(load_run(run_));
  const std::vector<TableRow> read = parse_case_table(case_table_csv(rows), "t.csv");
  std::vector<const TableRow*> all;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(rows[i].coarse_filter, reads_8_bits(rows[i].settings) ? 0.0039 : 0);
    EXPECT_EQ(read[i].coarse_filter, rows[i].coarse_filter);
    EXPECT_EQ(coarse_mark(read[i]), rows[i].coarse_filter > 0 ? CoarseFilter::kMark : "");
    all.push_back(&read[i]);
  }
  const CoarseFilter filter(nlohmann::json::parse(read_file(run_ / kRunFile)), "null");
  EXPECT_THAT(coarse_notes(all), testing::ElementsAre(filter.note()));
}

TEST(CoarseFilter, is_not_known_of_tables_of_before) {
  const std::filesystem::path old = std::filesystem::path(RELIEFBENCH_SOURCE_DIR) / "tests/data/exhaustive_rocks.csv";
  const std::vector<TableRow> rows = load_case_table(old);
  EXPECT_TRUE(std::ranges::all_of(rows, [](const TableRow& row) { return coarse_mark(row).empty(); }));
}

TEST_F(CoarselyFilteredRun, is_marked_where_a_fleet_has_it) {
  const std::vector<std::string> words = {"choose", marked_table("llvmpipe", true), marked_table("GPU", false),
                                          "--max-error", "e_xy.p95<=100"};
  const CommandResult text = ask(words);
  EXPECT_THAT(text.out, HasSubstr("] *\n  slower than"));
  EXPECT_THAT(text.out, testing::ContainsRegex("null llvmpipe in [^ ]* \\*"));
  EXPECT_THAT(text.out, testing::Not(testing::ContainsRegex("null GPU in [^ ]* \\*")));
  EXPECT_THAT(text.out, HasSubstr("* filter=hardware on llvmpipe (null), whose"));
  EXPECT_THAT(text.out, testing::Not(HasSubstr("hardware on GPU")));
  std::vector<std::string> json_words = words;
  json_words.emplace_back("--json");
  const nlohmann::json json = nlohmann::json::parse(ask(json_words).out);
  EXPECT_EQ(json.at("filter_notes").size(), 1U);
  for (const nlohmann::json& one : json.at("settings")) {
    EXPECT_EQ(one.at("places").at(0).at("coarse_filter"), 0.0039);
    EXPECT_EQ(one.at("places").at(1).at("coarse_filter"), 0);
  }
}

TEST_F(CoarselyFilteredRun, is_marked_at_the_choice_of_one_device) {
  keep_marked();
  for (const std::vector<std::string>& bound :
       {std::vector<std::string>{"--max-error", "e_xy.p95<=100"}, {"--max-time-ms", "1000"}}) {
    std::vector<std::string> words = {"choose", run_.string()};
    words.insert(words.end(), bound.begin(), bound.end());
    const CommandResult text = ask(words);
    EXPECT_THAT(text.out, HasSubstr("] *\n"));
    EXPECT_THAT(text.out, HasSubstr("* filter=hardware on null (null), whose"));
  }
}

TEST_F(CoarselyFilteredRun, is_marked_on_fronts_of_several_devices) {
  const std::vector<std::string> tables = {marked_table("llvmpipe", true), marked_table("GPU", false)};
  EXPECT_THAT(ask({"compare", tables[0], tables[1]}).out,
              AllOf(testing::ContainsRegex("front \\* +front  "), HasSubstr("* filter=hardware on llvmpipe (null)")));
  EXPECT_THAT(ask({"compare", tables[0], tables[1], "--markdown"}).out,
              AllOf(HasSubstr("| front * | front |"), HasSubstr("\n> \\* filter=hardware on llvmpipe (null)")));
  const nlohmann::json json = nlohmann::json::parse(ask({"compare", tables[0], tables[1], "--json"}).out);
  EXPECT_EQ(json.at("filter_notes").size(), 1U);
  const nlohmann::json& columns = json.at("fronts").at(0).at("on_some_front").at(0).at("columns");
  EXPECT_EQ(columns.at(0).at("coarse_filter"), 0.0039);
  EXPECT_EQ(columns.at(1).at("coarse_filter"), 0);
}

TEST_F(CoarselyFilteredRun, is_marked_at_quality_levels) {
  keep_marked();
  const std::filesystem::path file = folder_ / "presets.json";
  for (const bool is_common : {false, true}) {
    std::vector<std::string> words = {"presets",  run_.string(), "-o",           file.string(),
                                      "--header", "presets.h",   "--constraint", "e_xy.p95<=100"};
    if (is_common) words.emplace_back("--common");
    const CommandResult text = ask(words);
    EXPECT_THAT(text.out, AllOf(HasSubstr("] *\n"), HasSubstr("* filter=hardware on null (null), whose")));
    const nlohmann::json json = nlohmann::json::parse(read_file(file));
    EXPECT_EQ(schema_errors(json, "presets"), "");
    EXPECT_EQ(json.at("filter_notes").size(), 1U);
    for (const nlohmann::json& level : json.at("devices").at(0).at("levels"))
      EXPECT_EQ(level.at("evidence").at(0).at("coarse_filter"), 0.0039);
    const std::string header = read_file(folder_ / "presets.h");
    EXPECT_THAT(header, AllOf(HasSubstr("// * filter=hardware on null (null)"), HasSubstr(" *\n#define")));
  }
}

TEST_F(CoarselyFilteredRun, is_told_of_a_case_that_ships) {
  for (const TableRow& row : case_table(load_run(run_))) {
    const std::string out = (folder_ / "shipped").string();
    const CommandResult shipped = ask({"export", "--run", run_.string(), "--case", row.case_id, "-o", out});
    ASSERT_EQ(shipped.exit_code, 0) << shipped.err;
    const nlohmann::json settings = nlohmann::json::parse(read_file(folder_ / "shipped/settings.json"));
    EXPECT_EQ(schema_errors(settings, "export"), "");
    EXPECT_EQ(settings.at("evidence").at("scenes").at(0).at("coarse_filter"), row.coarse_filter) << row.case_id;
  }
}

TEST_F(CoarselyFilteredRun, is_marked_by_a_search_of_its_table) {
  TuneOptions options;
  options.quiet = true;
  const nlohmann::json of_run = tune_json(replay_tune(run_, "", options));
  std::filesystem::copy_file(run_ / kTableFile, folder_ / "before.csv");
  EXPECT_EQ(tune_json(replay_tune(folder_ / "before.csv", "", options)).at("filter").at("note"), "");
  std::ofstream(folder_ / "table.csv") << case_table_csv(case_table(load_run(run_)));
  EXPECT_EQ(tune_json(replay_tune(folder_ / "table.csv", "", options)).at("filter"), of_run.at("filter"));
}

}  // namespace
}  // namespace reliefbench
