#include <fmt/format.h>

#include "reports/pages/report.h"
#include "tests/browser.h"
#include "tests/synthetic_run.h"

namespace reliefbench {
namespace {

using testing::HasSubstr;
using testing::Not;

using ReportInBrowser = InBrowser;

bool shows(const std::string& dom, const std::string& text) { return dom.find(text) != std::string::npos; }

void expect_charts(const std::string& body, int charts, int points) {
  expect_drawn(body);
  EXPECT_THAT(body, HasSubstr(fmt::format("data-charts=\"{}\"", charts)));
  EXPECT_THAT(body, HasSubstr(fmt::format("data-points=\"{}\"", points)));
}

TEST_F(ReportInBrowser, DrawsAndAnswersToMouseAndKeyboard) {
  auto run = synthetic_run({});
  run.info["argv"] = {"reliefbench", "sweep", "my config.json", "-o", "out", "--pictures", "none"};
  const std::string probe = R"(
    const press = (target, key) => target.dispatchEvent(new KeyboardEvent('keydown', { key, bubbles: true }));
    const change = (metric) => { byId('metric').value = metricIndex.get(metric);
                                 byId('metric').dispatchEvent(new Event('change')); };
    result.missing = document.querySelector('.missing code').textContent;
    press(document.body, '3');
    result.flipped = document.querySelectorAll('.picture-card[data-kind=error]').length;
    const single = charts.find((entry) => !entry.spec.overlaid);
    press(single.canvas, 'ArrowRight');
    press(single.canvas, 'Enter');
    result.pinned = single.details.querySelector('.command code').textContent;
    const exact = single.chart.data.datasets[0].data.filter((dot) => dot.point.errors[state.metric] === 0);
    result.exactOutside = exact.filter(({ y }) => y > single.chart.options.plugins.extras.axis.band.top).length;
    result.exact = exact.length;
    const times = () => [...document.querySelectorAll('#front-tables table')][0].querySelectorAll('tbody tr td:nth-child(2)');
    const before = [...times()].map((cell) => cell.textContent);
    const head = document.querySelectorAll('#front-tables th')[1];
    head.querySelector('button').click();  // rising at first
    result.sorted = head.getAttribute('aria-sort');
    result.reversed = String(before.reverse().join() === [...times()].map((cell) => cell.textContent).join());
    result.titles = [...document.querySelectorAll('#front-tables th')].map((head) => head.textContent).join('|');
    change('psnr');
    result.axis = single.chart.options.scales.y.title.text;
    change('missed_rate');
    document.querySelectorAll('#technique-legend button')[1].click();
    result.hiddenLeft = single.chart.data.datasets[0].data.filter((dot) => techniqueOf(dot.point) === 'parallax').length;
    window.dispatchEvent(new Event('beforeprint'));
    window.dispatchEvent(new Event('afterprint'));
    result.probed = 'yes';
  )";
  const std::string body = body_tag(document(make_report(std::span(&run, 1)), probe));
  expect_charts(body, 9, 360);  // 2 backends x 3 scenes, and the backends of each scene laid over one another
  EXPECT_THAT(body, HasSubstr("data-probed=\"yes\""));
  EXPECT_THAT(body, HasSubstr("data-missing=\"reliefbench sweep 'my config.json' -o out\""));
  EXPECT_THAT(body, HasSubstr("data-flipped=\"6\""));
  EXPECT_THAT(
      body,
      HasSubstr("data-pinned=\"reliefbench sweep 'configs/quick start.json' -o out/one --filter 'flat@rocks/oblique?"));
  EXPECT_THAT(body, HasSubstr("data-exact-outside=\"0\""));
  EXPECT_THAT(body, Not(HasSubstr("data-exact=\"0\"")));
  EXPECT_THAT(body, HasSubstr("data-sorted=\"descending\""));
  EXPECT_THAT(body, HasSubstr("data-reversed=\"true\""));
  EXPECT_THAT(body, HasSubstr("|e_xy.p99 (texels)|missed_rate (share)|psnr (dB)|taps.mean (taps)|Map|"));
  EXPECT_THAT(body, HasSubstr("data-axis=\"psnr (dB), better downwards\""));
  EXPECT_THAT(body, HasSubstr("data-hidden-left=\"0\""));
}

TEST_F(ReportInBrowser, DrawsThousandsOfPointsOfSeveralDevices) {
  const std::vector<reliefbench::Run> runs = {
      synthetic_run({.folder = "a", .device = "Slow GPU", .backends = {"vulkan"}, .cases = 500, .slowness = 4}),
      synthetic_run({.folder = "b", .device = "Fast GPU", .backends = {"vulkan"}, .cases = 500})};
  const std::string dom = document(make_report(runs), "");
  expect_charts(body_tag(dom), 9, 3000);
  EXPECT_TRUE(shows(dom, "Devices compared"));
}

TEST_F(ReportInBrowser, DrawsRunsWithHolesInThem) {
  auto run = synthetic_run({.backends = {"null"}, .scenes = {"flat/top"}, .cases = 1});
  run.info = {{"budgets", {"e_xy.p99<=0"}}};  // as an early crash leaves it, and nothing meets the budget
  EXPECT_TRUE(shows(document(make_report(std::span(&run, 1)), ""), "Nothing meets the budget"));

  std::erase_if(run.records, [](const Record& record) { return record.status == Status::ok; });
  const std::string dom = document(make_report(std::span(&run, 1)), "");
  expect_charts(body_tag(dom), 0, 0);
  EXPECT_TRUE(shows(dom, "Nothing was measured"));
}

}  // namespace
}  // namespace reliefbench
