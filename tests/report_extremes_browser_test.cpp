// Reports of runs that are torn, hostile or large, in a browser.
#include <fmt/format.h>

#include <iostream>
#include <nlohmann/json.hpp>

#include "tests/report_probe.h"
#include "tests/synthetic_run.h"

namespace reliefbench {
namespace {

using testing::HasSubstr;
using testing::Not;

using ReportInBrowser = InBrowser;

TEST_F(ReportInBrowser, DrawsRunsWithHolesInThem) {
  reliefbench::Run run = synthetic_run({.backends = {"null"}, .scenes = {"flat/top"}, .cases = 1});
  run.info = {{"budgets", {"e_xy.p99<=0"}}};  // as an early crash leaves it, and nothing meets the budget
  std::string dom = document(report_of(run), "");
  expect_drawn(body_tag(dom));
  EXPECT_THAT(dom, HasSubstr("Nothing meets the budget"));

  std::erase_if(run.records, [](const Record& record) { return record.status == Status::ok; });
  dom = document(report_of(run), "byId('environment').open = true;");
  expect_drawn(body_tag(dom));
  EXPECT_THAT(dom, HasSubstr("Nothing was measured"));
}

// Whatever a folder from elsewhere calls its things: a page shows it, and runs none of it.
TEST_F(ReportInBrowser, HostileNamesAreTexts) {
  const std::string hostile =
      std::string(kHostileText) + "<img src=x onerror=\"document.body.dataset.owned='yes'\">=HYPERLINK(1)";
  reliefbench::Run run = synthetic_run({.folder = hostile, .device = hostile, .backends = {"vulkan"}, .cases = 12});
  for (Record& record : run.records) {
    record.case_id += hostile;
    record.scene += hostile;
    if (record.frame_time) record.frame_time->timer = hostile;
  }
  run.records.back().status = Status::ok;
  run.records.back().frame_time = run.records.front().frame_time;
  run.records.back().error = run.records.front().error;
  run.records.back().technique = hostile;  // as of another version
  run.records.back().params = {{hostile, hostile}};
  for (const char* field : {"name", "version", "git_sha", "started", "config_path"}) run.info[field] = hostile;
  run.info["argv"] = {hostile};
  run.info["devices"][0]["name"] = hostile;
  run.info["devices"][0]["audit"][0]["timer"] = hostile;
  run.info["devices"][0]["states"] = {
      {"blocks", 3}, {"blocks_held_back", 1}, {"clock_mhz", {1005, 1950}}, {"held_back", {hostile}}};
  run.info["host"] = {{"cpu", hostile}, {"os", hostile}, {"cores", 2}, {"memory_bytes", 1}};
  const std::string body = body_tag(document(report_of(run), R"(
    choose({pins: [...data.points.keys()]});
    byId('table').open = true;
    drawTable();
    byId('environment').open = true;
    for (const index of data.points.keys()) showHover(index, 5, 5, plotted.chart);
    result.formula = csvText().split('\n').filter((line) => /(?:^|,)["]?=/.test(line)).length;
    result.elements = document.querySelectorAll('img[src=x], #pins script').length;
    result.wide = document.documentElement.scrollWidth > innerWidth;
    byId('environment').dispatchEvent(new Event('toggle'));  // at once
    result.clocks = byId('environment').textContent.includes('1005 – 1950');
    result.held = byId('environment').textContent.includes('1 of 3 blocks, ');
    result.power = byId('environment').textContent.includes('Power (W)');
  )"));
  expect_drawn(body);
  EXPECT_THAT(body, Not(HasSubstr("data-owned")));
  EXPECT_THAT(body, has("elements", 0));
  EXPECT_THAT(body, has("formula", 0));
  EXPECT_THAT(body, has("wide", "false"));
  EXPECT_THAT(body, has("clocks", "true"));
  EXPECT_THAT(body, has("held", "true"));
  EXPECT_THAT(body, has("power", "false"));  // nobody told
}

// With the browser's clock: nothing is awaited here.
TEST_F(ReportInBrowser, FiveThousandCasesAreQuick) {
  const reliefbench::Run run = synthetic_run({.backends = {"vulkan"}, .scenes = {"rocks/oblique"}, .cases = 5000});
  const std::string probe = R"(
    const timed = (action) => { const start = performance.now(); action(); document.body.getBoundingClientRect();
                                return Math.round(performance.now() - start); };
    result.painted = Math.round(performance.getEntriesByType('paint').map(({startTime}) => startTime).concat(0)[0]);
    result.drawn = Math.round(performance.now());
    const set = (element, value, type) => { element.value = value; element.dispatchEvent(new Event(type, {bubbles: true})); };
    const median = (list) => [...list].sort((a, b) => a - b)[list.length >> 1];
    result.slider = median([100, 120, 140, 160, 180].map((v) => timed(() => set(byId('error-limit'), v, 'input'))));
    result.filter = median(['rg8', 'rg16', '', 'r8', ''].map((v) => timed(() => set(document.querySelector('#filters select[name=format]'), v, 'change'))));
    result.search = median(['c', 'co', 'con', 'cone', ''].map((v) => timed(() => set(byId('search'), v, 'input'))));
    result.metric = timed(() => set(byId('metric'), 2, 'change'));
    result.table = timed(() => { byId('table').open = true; drawTable(); });
    result.elements = document.querySelectorAll('*').length;
  )";
  const std::string body = body_tag(document(report_of(run), probe, {.in_real_time = true}));
  expect_drawn(body);
  EXPECT_THAT(body, has("points", 5000));
  const auto figure = [&](const std::string& name) {
    return told(body, name).is_number() ? told(body, name).get<double>() : 1e9;
  };
  std::cout << fmt::format(
      "5000 cases: first paint {} ms, drawn {} ms, a slider {} ms, a filter {} ms, a search {} ms, another "
      "metric {} ms, the table {} ms; {} elements\n",
      figure("painted"), figure("drawn"), figure("slider"), figure("filter"), figure("search"), figure("metric"),
      figure("table"), figure("elements"));
  for (const std::string timed : {"painted", "drawn", "slider", "filter", "search", "metric", "table"})
    EXPECT_TRUE(told(body, timed).is_number()) << timed;  // times are printed: a busy machine has others
  // Some 5,000, by how many settings are on the fronts, whatever the cases; with one a case it would be twice as many.
  EXPECT_LT(figure("elements"), 7500) << "an element a case is slow anywhere";
}

}  // namespace
}  // namespace reliefbench
