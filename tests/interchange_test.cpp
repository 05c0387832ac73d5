// table.csv, t4.json, and the table that a search replays: from a run's folder and from its table.csv alone.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "kernels/base/append_file.h"
#include "kernels/base/error.h"
#include "tests/finished_run.h"
#include "tests/schema.h"
#include "tests/written_tables.h"
#include "tuner/decide/pareto.h"
#include "tuner/results/case_table.h"
#include "tuner/results/csv.h"
#include "tuner/results/recorded_run.h"
#include "tuner/results/run_files.h"
#include "tuner/results/t4.h"

namespace reliefbench {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

std::string replaced(std::string text, std::string_view from, std::string_view to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(Csv, any_text_comes_back) {
  const std::vector<std::string> cells = {"", "plain", "a,b", "say \"no\"", "two\r\nlines", kHostileText, " edge "};
  const std::string text = csv_line(cells) + csv_line(cells);
  const std::vector<CsvRow> rows = parse_csv("\xEF\xBB\xBF" + text, "f");
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0].cells, cells);
  EXPECT_EQ(rows[1].cells, cells);
  EXPECT_EQ(rows[1].line, 3);
  EXPECT_EQ(parse_csv("a,b\nc,d", "f")[1].cells, (std::vector<std::string>{"c", "d"}));
  EXPECT_TRUE(parse_csv("", "f").empty());
}

TEST(Csv, what_is_broken_is_named_with_its_line) {
  const auto fails = [](std::string_view text, const std::string& words) {
    EXPECT_THAT([&] { (void)parse_csv(text, "f.csv"); }, ThrowsMessage<Error>(HasSubstr(words))) << text;
  };
  fails("a,b\nc,\"d\n\n", "f.csv:2: a quoted cell has no end");
  fails("a,b\n\"c\"x,d\n", "f.csv:2: text after a closing quote");
  fails("a,b\nc,d\"\n", "f.csv:2: a quote within a cell");
  fails("a,b\nc\n", "f.csv:2: has 1 cells, the first line 2");
  fails("a,b\rc,d", "f.csv:1: a carriage return");
}

void expect_same_row(const TableRow& a, const TableRow& b) {
  EXPECT_EQ(a.case_id, b.case_id);
  EXPECT_EQ(&a.settings.technique(), &b.settings.technique());
  EXPECT_EQ(a.settings.text(), b.settings.text());
  EXPECT_EQ(a.map, b.map);
  EXPECT_EQ(measured_device(a), measured_device(b));
  EXPECT_EQ(a.scene, b.scene);
  EXPECT_EQ(a.scene_key, b.scene_key);
  EXPECT_EQ(a.status, b.status);
  EXPECT_EQ(a.reason, b.reason);
  EXPECT_EQ(a.errors, b.errors);
  EXPECT_EQ(a.memory_bytes, b.memory_bytes);
  EXPECT_EQ(a.bake_time_ns, b.bake_time_ns);
  EXPECT_EQ(a.device_bake_ns, b.device_bake_ns);
  EXPECT_EQ(a.first_draw_ns, b.first_draw_ns);
  EXPECT_EQ(a.ns_per_px, b.ns_per_px);
  ASSERT_EQ(a.frame_time.has_value(), b.frame_time.has_value());
  if (a.frame_time) {
    EXPECT_EQ(a.frame_time->median, b.frame_time->median);
    EXPECT_EQ(a.frame_time->ci_high, b.frame_time->ci_high);
  }
  ASSERT_EQ(a.samples_ns.size(), b.samples_ns.size());
  for (std::size_t i = 0; i < a.samples_ns.size(); ++i)
    EXPECT_NEAR(a.samples_ns[i], b.samples_ns[i], 5e-5 * a.samples_ns[i]);
}

TEST(CaseTable, every_case_comes_back_up_to_the_digits_of_its_samples) {
  const std::vector<TableRow> rows = case_table(sampled_run({.device = kHostileText, .cases = 40}));
  const std::vector<TableRow> read = parse_case_table(case_table_csv(rows), "table.csv");
  ASSERT_EQ(read.size(), rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) expect_same_row(rows[i], read[i]);
}

TEST(CaseTable, samples_are_free_of_drift) {
  const reliefbench::Run run = sampled_run({.backends = {"opengl"}, .cases = 12});
  const std::vector<TableRow> rows = case_table(run);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].status != Status::ok) {
      EXPECT_TRUE(rows[i].samples_ns.empty());
      continue;
    }
    ASSERT_EQ(rows[i].samples_ns.size(), 3U);
    EXPECT_NEAR(rows[i].samples_ns[1], run.records[i].frame_time->summary.median, 2e-3 * rows[i].samples_ns[1]);
  }
}

TEST(CaseTable, the_samples_of_a_sweep_sum_up_to_what_it_recorded) {
  const TempFolder folder;
  for (const TableRow& row : case_table(load_run(null_sweep(folder)))) {
    ASSERT_TRUE(row.frame_time);
    EXPECT_DOUBLE_EQ(median(row.samples_ns), row.frame_time->median) << row.case_id;
  }
}

TEST(CaseTable, a_bake_by_the_device_is_blank_where_there_was_none) {
  const TempFolder folder;
  std::vector<TableRow> rows = case_table(load_run(null_sweep(folder)));
  rows[0].device_bake_ns = 12.5;
  std::string text = case_table_csv(rows);
  const std::vector<TableRow> read = parse_case_table(text, "t.csv");
  EXPECT_EQ(read[0].device_bake_ns, 12.5);
  EXPECT_FALSE(read[1].device_bake_ns);
  // A table of before there was such a column.
  rows.erase(rows.begin() + 1, rows.end());
  text = replaced(replaced(case_table_csv(rows), ",device_bake_ns,", ","), ",12.5,", ",");
  EXPECT_FALSE(parse_case_table(text, "t.csv")[0].device_bake_ns);
}

TEST(CaseTable, a_time_per_pixel_is_of_the_frame) {
  const TempFolder folder;
  reliefbench::Run run = load_run(null_sweep(folder));
  const Scene& scene = run.scenes.front().spec.scene;
  const double pixels = static_cast<double>(scene.width_px) * scene.height_px;
  const std::vector<TableRow> rows = case_table(run);
  for (const TableRow& row : rows)
    if (row.scene == run.scenes.front().spec.id) {
      EXPECT_EQ(row.ns_per_px, row.frame_time->median / pixels);
    }
  // A table of before there was such a column, and a run that does not say what its scenes are.
  std::string text = case_table_csv(rows);
  text.replace(text.find(",median_ns_per_px,"), 18, ",");
  for (const TableRow& row : rows) {
    const std::string cell = fmt::format(",{},", *row.ns_per_px);
    text.replace(text.find(cell, text.find(row.case_id)), cell.size(), ",");
  }
  EXPECT_FALSE(parse_case_table(text, "old.csv").front().ns_per_px);
  run.scenes.clear();
  EXPECT_FALSE(case_table(run).front().ns_per_px);
}

TEST(CaseTable, no_number_that_is_none_is_written) {
  std::vector<TableRow> rows = case_table(sampled_run({.cases = 3}));
  rows[1].errors[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT([&] { (void)case_table_csv(rows); }, ThrowsMessage<Error>(HasSubstr("e_xy.mean is nan")));
  rows[1].errors[0] = 0;
  rows[1].samples_ns[0] = std::numeric_limits<double>::infinity();
  EXPECT_THAT([&] { (void)case_table_csv(rows); }, ThrowsMessage<Error>(HasSubstr("samples_ns is inf")));
}

TEST(CaseTable, a_broken_table_is_refused_with_line_and_column) {
  const TempFolder folder;
  const std::string good = read_file(null_sweep(folder) / kTableFile);
  ASSERT_NO_THROW((void)parse_case_table(good, "t.csv"));
  const auto fails = [](const std::string& text, const std::string& words) {
    EXPECT_THAT([&] { (void)parse_case_table(text, "t.csv"); }, ThrowsMessage<Error>(HasSubstr(words)));
  };
  fails("", "t.csv:1: is empty");
  fails(std::string(2 << 20, 'x'), "t.csv:1: a row of over 1048576 bytes");
  fails(good + '"' + std::string(2 << 20, 'x'), "bytes, expected one case");
  fails(std::string(2 << 20, ','), "t.csv:1: a row of over 1048576 bytes");
  fails(replaced(good, "linear_steps", "linear_stops"), "t.csv:1: column 'linear_stops': unknown");
  fails(replaced(good, "ci_high_ns,", "ci_low_ns,"), "t.csv:1: column 'ci_low_ns': stands twice");
  fails(replaced(good, ",cone,null,", ",cane,null,"), "t.csv:2: column 'technique': technique 'cane' is unknown");
  fails(replaced(good, ",ok,", ",fine,"), "t.csv:2: column 'status': unknown status 'fine'");
  fails(replaced(good, ",conservative,,", ",wrong,,"), "t.csv:2: column 'map': map='wrong' is unknown");
  fails(replaced(good, ",conservative,,", ",conservative,plain,"),
        "t.csv:2: column 'variant': is 'plain', but means nothing");
  fails(replaced(good, ",rg8,hardware,", ",,hardware,"), "t.csv:14: column 'format': is blank, but 'cone' needs it");
  fails(replaced(good, "\r\ncone@", "\r\ncone@") + good.substr(good.find("\r\n") + 2), "column 'case'");
}

TEST(RecordedRun, a_folder_and_its_table_hold_the_same_search) {
  const TempFolder folder;
  const std::filesystem::path run = null_sweep(folder);
  const RecordedTable a = load_recorded(run, {});
  EXPECT_EQ(a.error_metric, "e_xy.p95");
  EXPECT_EQ(a.constraints, std::vector<std::string>{"missed_rate<=0.5"});
  const RecordedTable b =
      load_recorded(run / kTableFile, {.error_metric = a.error_metric, .constraints = {{{"missed_rate", 0.5}}}});
  EXPECT_EQ(a.backend + a.device + a.scene, b.backend + b.device + b.scene);
  EXPECT_EQ(a.constraints, b.constraints);
  EXPECT_EQ(a.space.category_axes, b.space.category_axes);
  EXPECT_EQ(a.space.step_axes, b.space.step_axes);
  EXPECT_EQ(a.space.work_axes, (std::vector<std::string>{"taps.mean", "taps.max"}));
  ASSERT_EQ(a.space.candidates.size(), 61U);
  ASSERT_EQ(a.space.candidates.size(), b.space.candidates.size());
  for (std::size_t i = 0; i < a.samples.size(); ++i) {
    const Candidate& left = a.space.candidates[i];
    const Candidate& right = b.space.candidates[i];
    EXPECT_EQ(left.id, right.id);
    EXPECT_EQ(left.categories, right.categories);
    EXPECT_EQ(left.steps, right.steps);
    EXPECT_EQ(left.error, right.error);
    EXPECT_EQ(left.is_feasible, right.is_feasible);
    EXPECT_EQ(left.work, right.work);
    ASSERT_EQ(a.samples[i].size(), 5U);
    for (std::size_t s = 0; s < a.samples[i].size(); ++s)
      EXPECT_NEAR(a.samples[i][s], b.samples[i][s], 5e-5 * a.samples[i][s]);
  }
  // A table alone is judged as a config without a "front" would be.
  EXPECT_EQ(load_recorded(run / kTableFile, {}).error_metric, Config{}.front_error);
}

TEST(RecordedRun, feasible_is_what_the_front_may_hold) {
  const reliefbench::Run run = sampled_run({.backends = {"opengl"}, .scenes = {"s/a"}, .cases = 50});
  const std::vector<Budget> constraints = {{"missed_rate", 0.001}};
  const RecordedTable table =
      recorded_table(case_table(run), {.error_metric = "e_xy.p99", .constraints = constraints}, "f");
  ASSERT_EQ(table.samples.size(), 50U);
  for (std::size_t i = 0; i < 50; ++i) {
    EXPECT_EQ(table.space.candidates[i].is_feasible, meets(run.records[i], constraints[0]));
    EXPECT_EQ(table.space.candidates[i].error, run.records[i].error->at("e_xy.p99"));
    EXPECT_EQ(table.space.candidates[i].work,
              (std::vector{run.records[i].error->at("taps.mean"), run.records[i].error->at("taps.max")}));
  }
}

TEST(RecordedRun, one_of_several_must_be_chosen) {
  const std::vector<TableRow> rows = case_table(sampled_run({.cases = 5}));
  const auto fails = [&](RecordedQuery query, const auto& words) {
    if (!query.error_metric) query.error_metric = "e_xy.p99";
    query.constraints = std::vector<Budget>{};
    EXPECT_THAT([&] { (void)recorded_table(rows, query, "out/run"); }, ThrowsMessage<Error>(words));
  };
  fails({}, AllOf(HasSubstr("out/run: holds 6 sweeps"), HasSubstr("--backend and --scene"),
                  HasSubstr("vulkan rocks/grazing")));
  fails({.backend = "opengl"}, HasSubstr("holds 3 sweeps"));
  fails({.backend = "null"}, HasSubstr("nothing of backend 'null'"));
  fails({.backend = "opengl", .scene = "rocks/top"}, HasSubstr("scene 'rocks/top'"));
  fails({.backend = "opengl", .scene = "rocks/grazing", .error_metric = "psnr"}, HasSubstr("higher is better"));
  fails({.backend = "opengl", .scene = "rocks/grazing", .error_metric = "flicker"}, HasSubstr("no case of opengl"));
  fails({.backend = "opengl", .scene = "rocks/grazing", .error_metric = "beauty"}, HasSubstr("beauty"));
  EXPECT_THAT([] { (void)load_recorded("no/such/run", {}); }, ThrowsMessage<Error>(HasSubstr("no/such/run")));
}

TEST(T4, is_valid_and_tells_how_a_case_ended) {
  const reliefbench::Run run = sampled_run({.backends = {"opengl"}, .scenes = {"s/a"}, .cases = 40});
  const std::vector<Budget> constraints = {{"missed_rate", 0.001}};
  const nlohmann::json t4 = t4_json(run, case_table(run), constraints);
  EXPECT_EQ(schema_errors(t4, "t4"), "");
  ASSERT_EQ(t4["results"].size(), run.records.size());
  std::map<std::string, int> counts;
  for (std::size_t i = 0; i < run.records.size(); ++i) {
    const nlohmann::json& result = t4["results"][i];
    counts[result["invalidity"]] += 1;
    EXPECT_EQ(result["times"]["runtimes"].size(), run.records[i].status == Status::ok ? 3U : 0U);
    EXPECT_EQ(result["configuration"]["technique"], run.records[i].technique);
    EXPECT_EQ(result["configuration"]["scene_key"], run.records[i].scene_key.hex);
    EXPECT_EQ(result["configuration"].size(), run.records[i].params.size() + 4);
  }
  EXPECT_EQ(counts["correct"] + counts["correctness"], 40);
  EXPECT_GT(counts["correctness"], 0);
  EXPECT_EQ(counts["constraints"], 1);  // unsupported
  EXPECT_EQ(counts["compile"], 1);
  EXPECT_EQ(counts["timeout"], 1);
  EXPECT_EQ(counts["runtime"], 5);  // device_lost, out_of_memory, invalid_timer, throttled, crashed

  nlohmann::json bad = t4;
  bad["results"][0]["invalidity"] = "fine";
  EXPECT_NE(schema_errors(bad, "t4"), "");
}

TEST(T4, a_sweep_leaves_a_valid_one) {
  const TempFolder folder;
  const nlohmann::json t4 = nlohmann::json::parse(read_file(null_sweep(folder) / kT4File));
  EXPECT_EQ(schema_errors(t4, "t4"), "");
  EXPECT_EQ(t4["results"].size(), 61U);
}

}  // namespace
}  // namespace reliefbench
