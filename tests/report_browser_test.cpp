#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "reports/report.h"
#include "tests/synthetic_run.h"

namespace reliefbench {
namespace {

using testing::HasSubstr;
using testing::Not;

std::string output_of(const std::string& command) {
  const auto close = [](FILE* pipe) { pclose(pipe); };
  const std::unique_ptr<FILE, decltype(close)> pipe(popen(command.c_str(), "r"), close);
  std::string text;
  std::array<char, 1 << 16> buffer{};
  for (std::size_t n = 0; (n = fread(buffer.data(), 1, buffer.size(), pipe.get())) > 0;) text.append(buffer.data(), n);
  return text;
}

/// Opens pages in headless Chromium, as a reader does: from a file, without a network.
class ReportInBrowser : public testing::Test {
 protected:
  void SetUp() override {
    if (output_of("command -v chromium").empty())
      GTEST_SKIP() << "chromium is not installed (apt-get install chromium)";
    std::string pattern = testing::TempDir() + "reliefbench_browser_XXXXXX";
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override {
    if (!folder_.empty()) std::filesystem::remove_all(folder_);
  }

  /// The document once its scripts have run. `probe` is a script that runs after the page's own.
  std::string document(std::string html, const std::string& probe) const {
    const std::string script =
        "<script>addEventListener('load', () => { document.body.dataset.resources = "
        "performance.getEntriesByType('resource').filter((e) => !e.name.startsWith('data:')).length;" +
        probe + "});</script>";
    const std::size_t end = html.rfind("</body>");
    if (end == std::string::npos) return "";
    html.insert(end, script);
    std::ofstream(folder_ / "report.html") << html;
    return output_of(fmt::format(
        "timeout 120 chromium --headless --no-sandbox --disable-gpu --disable-quic --disable-dev-shm-usage "
        "--no-first-run --disable-background-networking --disable-component-update --disable-sync "
        "--user-data-dir='{0}/profile' --virtual-time-budget=10000 --dump-dom 'file://{0}/report.html' 2>/dev/null",
        folder_.string()));
  }

 private:
  std::filesystem::path folder_;
};

/// The start tag, whose data attributes tell what the scripts found.
std::string body_tag(const std::string& dom) {
  const std::size_t begin = dom.find("<body");
  return begin == std::string::npos ? "no page" : dom.substr(begin, dom.find("\n<script>", begin) - begin);
}

bool shows(const std::string& dom, const std::string& text) { return dom.find(text) != std::string::npos; }

void expect_drawn(const std::string& body, int charts, int points) {
  EXPECT_THAT(body, HasSubstr("data-rendered=\"true\""));
  EXPECT_THAT(body, HasSubstr(fmt::format("data-charts=\"{}\"", charts)));
  EXPECT_THAT(body, HasSubstr(fmt::format("data-points=\"{}\"", points)));
  EXPECT_THAT(body, HasSubstr("data-resources=\"0\""));
  EXPECT_THAT(body, Not(HasSubstr("data-errors=")));
}

TEST_F(ReportInBrowser, DrawsAndAnswersToMouseAndKeyboard) {
  const auto run = synthetic_run({});
  const std::string probe = R"(
    const result = document.body.dataset;
    const press = (target, key) => target.dispatchEvent(new KeyboardEvent('keydown', { key, bubbles: true }));
    const change = (metric) => { byId('metric').value = metricIndex.get(metric);
                                 byId('metric').dispatchEvent(new Event('change')); };
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
  expect_drawn(body, 9, 360);  // 2 backends x 3 scenes, and the backends of each scene laid over one another
  EXPECT_THAT(body, HasSubstr("data-probed=\"yes\""));
  EXPECT_THAT(body, HasSubstr("data-flipped=\"6\""));
  EXPECT_THAT(
      body,
      HasSubstr("data-pinned=\"reliefbench sweep 'configs/quick start.json' -o out/one --filter 'flat@rocks/oblique?"));
  EXPECT_THAT(body, HasSubstr("data-exact-outside=\"0\""));
  EXPECT_THAT(body, Not(HasSubstr("data-exact=\"0\"")));
  EXPECT_THAT(body, HasSubstr("data-sorted=\"descending\""));
  EXPECT_THAT(body, HasSubstr("data-reversed=\"true\""));
  EXPECT_THAT(body, HasSubstr("data-axis=\"psnr (dB), better downwards\""));
  EXPECT_THAT(body, HasSubstr("data-hidden-left=\"0\""));
}

TEST_F(ReportInBrowser, DrawsThousandsOfPointsOfSeveralDevices) {
  const std::vector<reliefbench::Run> runs = {
      synthetic_run({.folder = "a", .device = "Slow GPU", .backends = {"vulkan"}, .cases = 500, .slowness = 4}),
      synthetic_run({.folder = "b", .device = "Fast GPU", .backends = {"vulkan"}, .cases = 500})};
  const std::string dom = document(make_report(runs), "");
  expect_drawn(body_tag(dom), 9, 3000);
  EXPECT_TRUE(shows(dom, "Devices compared"));
}

TEST_F(ReportInBrowser, DrawsRunsWithHolesInThem) {
  auto run = synthetic_run({.backends = {"null"}, .scenes = {"flat/top"}, .cases = 1});
  run.info = {{"budgets", {"e_xy.p99<=0"}}};  // as an early crash leaves it, and nothing meets the budget
  EXPECT_TRUE(shows(document(make_report(std::span(&run, 1)), ""), "Nothing meets the budget"));

  std::erase_if(run.records, [](const Record& record) { return record.status == Status::ok; });
  const std::string dom = document(make_report(std::span(&run, 1)), "");
  expect_drawn(body_tag(dom), 0, 0);
  EXPECT_TRUE(shows(dom, "Nothing was measured"));
}

}  // namespace
}  // namespace reliefbench
