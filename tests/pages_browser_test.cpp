// The pages of stress, tune and tuners, and the report's section of stress, as a browser draws them.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <set>
#include <string_view>

#include "kernels/base/append_file.h"
#include "reports/pages/report.h"
#include "reports/pages/require_page.h"
#include "reports/pages/tune_page.h"
#include "reports/pages/tuners_page.h"
#include "tests/browser.h"
#include "tests/finished_run.h"
#include "tests/hand_made_stress.h"
#include "tests/hostile_page.h"
#include "tuner/measure/require_run.h"
#include "tuner/plan/scene_file.h"
#include "tuner/plan/setting_names.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/recorded_run.h"
#include "tuner/search/strategies.h"

namespace reliefbench {
namespace {

using testing::HasSubstr;
using testing::Not;

class ExtremesInBrowser : public InBrowser {
 protected:
  const std::filesystem::path stress_ = write_hand_made_stress(folder_ / "stress");
  const std::string probe_ = R"(
    const rows = [...document.querySelectorAll('#extremes-matrix tr')];
    result.matrix = rows.map((row) => [...row.cells].map((cell) => cell.textContent).join('|')).join('; ');
    document.querySelector('#extremes-matrix .fails button').click();
    result.cell = byId('extremes-cell').querySelector('h4').textContent;
    result.faults = byId('extremes-faults').querySelector('tbody').textContent;
    const images = [...document.querySelectorAll('#extremes-worst img')];
    result.pictures = images.filter((image) => image.complete && image.naturalWidth === 2).length;
    result.captions = document.querySelectorAll('#extremes-worst figcaption').length;
    result.summary = byId('extremes-summary').textContent;
    result.shown = String(byId('extremes').getBoundingClientRect().height > 0);
  )";
  static void expect_extremes(const std::string& body) {
    expect_drawn(body);
    EXPECT_THAT(body, has("matrix", "|flat|cone; cliff|25 %|held; deep|left out|fails 1"));
    EXPECT_THAT(body, has("cell", "cone at deep: 10"));
    const Settings failing = parse_setting("cone?filter=manual&loop=fixed");
    EXPECT_THAT(body, has("faults", fmt::format("heightr8null0 %0 %01.500guarantee: 3 px{} [{}]", short_name(failing),
                                                setting_key(failing))));
    EXPECT_THAT(body, has("captions", 2));
    EXPECT_THAT(body, has("shown", "true"));
  }
};

TEST_F(ExtremesInBrowser, TheStressPageHoldsMatrixFaultsAndWorstFrames) {
  const std::string body = body_tag(document(read_file(stress_ / kStressPage), probe_));
  expect_extremes(body);
  EXPECT_THAT(body, has("pictures", 2));
}

TEST_F(ExtremesInBrowser, AnInterruptedRunSaysSo) {
  StressReport report = hand_made_stress();
  EXPECT_THAT(body_tag(document(read_file(stress_ / kStressPage), probe_)),
              has("summary", "Something fails: 3 pairs of frames in 0 s on null: device."));
  report.undone = 7;
  write_stress(report, stress_);
  EXPECT_THAT(body_tag(document(read_file(stress_ / kStressPage), probe_)),
              has("summary",
                  "Something fails: 3 pairs of frames in 0 s on null: device. "
                  "Interrupted: 7 settings at extremes were not drawn."));
}

TEST_F(ExtremesInBrowser, TheReportHoldsTheSameWhereItIsAskedFor) {
  const auto run = synthetic_run({.cases = 2});
  std::filesystem::remove(stress_ / "images" / "flat.png");
  const std::string body = body_tag(document(make_report(std::span(&run, 1), stress_), probe_));
  expect_extremes(body);
  EXPECT_THAT(body, has("pictures", 1));

  const std::string hidden =
      "result.hidden = [...document.querySelectorAll('#extremes, a[href=\"#extremes\"]')]"
      ".filter((element) => getComputedStyle(element).display === 'none').length;";
  EXPECT_THAT(body_tag(document(make_report(std::span(&run, 1)), hidden)), has("hidden", 2));
}

class TuneInBrowser : public InBrowser {
 protected:
  /// Of the null sweep, replayed; has_fleet: with the same times as of another device, whose filter is coarse.
  [[nodiscard]] TuneResult tuned(const std::vector<Budget>& max_error, bool has_fleet = false) const {
    const std::filesystem::path run = null_sweep(folder_);
    TuneOptions options{.question = {.max_error = max_error}, .quiet = true};
    if (has_fleet) {
      options.fleet.emplace(TuneFleet{.runs = {load_fleet_run(run)}});
      for (TableRow& row : options.fleet->runs.front().rows) {
        row.device = "Another GPU";
        row.coarse_filter = 0.0039;  // of the pick, too, which is flat
      }
    }
    return replay_tune(run, "", options);
  }
  [[nodiscard]] std::string body_of(const TuneResult& result) const {
    write_tune_page(result, folder_.path());
    return body_tag(document(read_file(folder_ / std::string(kTunePage)), R"(
      const rows = (id) => byId(id).querySelectorAll('tbody tr').length;
      const chart = (id) => byId(id) && Chart.getChart(id);
      const dots = (id) => chart(id) ? chart(id).data.datasets.map((set) => set.data.length).join() : 'none';
      for (const id of ['rungs', 'tune-answers', 'tune-states']) result[id.replace('tune-', '')] = rows(id);
      for (const id of ['gap', 'budget-gap']) result[id.replace('-', '')] = dots(id);
      result.plotted = plotted.dots.length;
      // The search's answers are the front of what it timed.
      result.front = String(plotted.fronts.length > 0 && data.tune.answers.every(
          ({setting}) => numberedFront().some((i) => data.points[i].id.startsWith(setting.split('?')[0]))));
      result.answered = document.querySelectorAll('#answer-cards .sentence').length;
      // One page has one answer: what the search certifies.
      const [pick] = data.tune.pick ? [answerOf(0, 0).pick] : [];
      result.same = String(pick !== undefined && pick === data.tune.pick_point);
      result.historydots = dots('history');
      result.history = String(Chart.getChart('history').data.datasets.every((set) => set.data.length > 0));
      result.pick = byId('tune-pick').querySelector('p').textContent.replaceAll('&', ' ');
      result.fleet = `${byId('fleet').hidden} ${byId('fleet-rows').textContent}`;
      if (data.points.length) {
        choose({pins: [...data.points.keys()]});
        result.rows = [...document.querySelectorAll('#pins tbody th')].map((th) => th.textContent).join();
        result.commands = [...new Set([...document.querySelectorAll('#pins .command-line')].map((p) => p.textContent.split(' ').slice(0, 4).join(' ')))].join('|');
        result.maps = [...document.querySelectorAll('select[name=map] option')].map((o) => o.textContent).join();
        result.asked = byId('budget').textContent.replaceAll('<', '');
        result.bounds = byId('budgets').textContent;
      }
      const historyChart = Chart.getChart('history');
      result.axis = historyChart.options.scales.y.title.text;
      result.within = byId('tune-pick').textContent;
      result.certified = document.querySelectorAll('#tune-pick .certified').length;
    )"));
  }
};

TEST_F(TuneInBrowser, DrawsThePickAndHowItWasFound) {
  const TuneResult result = tuned({});
  ASSERT_TRUE(result.pick);
  const std::vector<BudgetAnswer>& answers = result.search.answers;
  ASSERT_GT(answers.size(), 2U);
  const std::string body = body_of(result);
  expect_drawn(body);
  EXPECT_THAT(body, has("rungs", result.rungs.size()));
  EXPECT_THAT(body, has("answers", answers.size()));
  EXPECT_THAT(body, has("budgetgap", answers.size()));
  EXPECT_THAT(body, has("history", "true"));
  EXPECT_THAT(body, has("certified", 1));
  const Settings picked = parse_setting(result.pick->setting);
  EXPECT_THAT(body, has("pick", fmt::format("{} [{}]", short_name(picked), setting_key(picked))));
  const nlohmann::json settings = tune_json(result)["settings"];
  const auto is_shown = [](const auto& s) { return s["feasible"] == true && s["evidence"] == "measured"; };
  EXPECT_THAT(body, has("plotted", static_cast<std::size_t>(std::ranges::count_if(settings, is_shown))));
  EXPECT_THAT(body, has("front", "true"));
  EXPECT_THAT(body, has("answered", 1));
  EXPECT_THAT(body, has("same", "true"));
  // What the search does not know is not there, and what is offered can be run.
  EXPECT_THAT(body, testing::ContainsRegex("data-rows=\"[^\"]*Frame time,Interval,[^\"]*Timer,Use it"));
  EXPECT_THAT(body, Not(testing::ContainsRegex("data-rows=\"[^\"]*(Map|First draw)")));
  const std::string replayed = (folder_ / "run").string();
  EXPECT_THAT(body, has("commands", fmt::format("reliefbench view --run {0}|reliefbench export --run {0}", replayed)));
  EXPECT_THAT(body, HasSubstr("(all that is shown keeps missed_rate ≤ 0.5):"));
  EXPECT_THAT(body, testing::ContainsRegex("data-within=\"[^\"]*within [0-9.]+ % of the best"));
}

// Of what was not scored nothing is known, so that the gap is to the best of what was.
TEST_F(TuneInBrowser, SaysWhatTheGapIsTo) {
  TuneResult result = tuned({{"e_xy.p95", 1}, {"missed_rate", 0.3}});
  ASSERT_TRUE(result.pick);
  result.counts.unscored = 5;
  const std::string body = body_of(result);
  expect_drawn(body);
  EXPECT_THAT(body, HasSubstr(fmt::format("within {:.2f} % of the best of those scored", 100 * result.pick->gap)));
  EXPECT_THAT(body, has("axis", "ms"));
  EXPECT_THAT(body, HasSubstr(" (all that is shown keeps missed_rate ≤ 0.3):"));
  EXPECT_THAT(body, testing::ContainsRegex("data-bounds=\"[^\"]*and missed_rate ≤ 0.3"));
}

TEST_F(TuneInBrowser, DrawsHowTheOneAnswerOfABudgetCameToBe) {
  const TuneResult result = tuned({{"missed_rate", 0.3}}, true);
  ASSERT_TRUE(result.pick);
  ASSERT_EQ(result.search.answers.size(), 1U);
  const std::string body = body_of(result);
  expect_drawn(body);
  EXPECT_THAT(body, has("budgetgap", "none"));
  EXPECT_THAT(body, HasSubstr("data-fleet=\"false "));
  EXPECT_THAT(body, HasSubstr("slower than each place's own best"));
  EXPECT_THAT(body, HasSubstr("Another GPU (null) *"));
  const std::vector<PathPoint>& path = result.search.path;
  EXPECT_GT(path.size(), 3U);
  const auto has_pick = [](const PathPoint& point) { return !point.picks.empty(); };
  EXPECT_THAT(body, has("historydots", std::ranges::count_if(path, has_pick)));
  const auto drawn = [&](double PathPoint::*gap) {
    return std::ranges::count_if(path, [&](const PathPoint& p) { return p.*gap > 0 && std::isfinite(p.*gap); });
  };
  EXPECT_THAT(body, has("gap", fmt::format("{},{},2", drawn(&PathPoint::worst_gap), drawn(&PathPoint::timed_gap))));
}

TEST_F(TuneInBrowser, SaysWhatComesNearestWhereNothingDoes) {
  const TuneResult result = tuned({{"e_xy.mean", -1}});
  ASSERT_FALSE(result.pick);
  const std::string body = body_of(result);
  expect_drawn(body);
  EXPECT_THAT(body, has("pick", "Nothing meets the budgets: " + result.miss));
  EXPECT_THAT(body, has("answers", 0));
}

using TunersInBrowser = InBrowser;
using PagesInBrowser = InBrowser;

TEST_F(TunersInBrowser, DrawsALineAndRowsOfEveryStrategy) {
  const TunerComparison comparison =
      compare_tuners(load_recorded(null_sweep(folder_), {}), {.seeds = 2, .shares = {0.1, 1}, .certificates = 3});
  write_tuners_page(comparison, folder_ / "tuners.html");
  const std::string body = body_tag(document(read_file(folder_ / "tuners.html"), R"(
    const lines = (id) => Chart.getChart(id).data.datasets;
    result.lines = lines('regret').length + ' ' + lines('hypervolume').length;
    result.dots = [...lines('regret'), ...lines('hypervolume')].reduce((sum, line) => sum + line.data.length, 0);
    result.above = lines('regret').flatMap((line) => line.data).filter(({y}) => y === noAnswer).length;
    result.rows = document.querySelectorAll('#table tbody tr').length;
    result.hypervolume = byId('table').querySelector('tbody tr:last-child td:nth-child(11)').textContent;
    const tick = () => Chart.getChart('regret').options.scales.x.ticks.color;
    result.tick = tick();
    window.dispatchEvent(new Event('beforeprint'));
    result.printed = tick();
    window.dispatchEvent(new Event('afterprint'));
    result.subtitle = byId('subtitle').textContent.replace('<=', ' to ');
    result.certificate = byId('certificate').textContent.replace(/"/g, '');
  )",
                                             {.is_dark = true}));
  expect_drawn(body);
  const CertificateCheck& check = comparison.certificate;
  EXPECT_THAT(body, HasSubstr(fmt::format("given in {} of 3 seeds, true in {} of these", check.certified, check.held)));
  const std::size_t count = strategies().size();
  EXPECT_THAT(body, has("lines", fmt::format("{0} {0}", 2 * count)));
  EXPECT_THAT(body, has("dots", 2 * 2 * count * 2));  // charts, mean and worst, shares
  EXPECT_THAT(body, has("rows", 2 * count));
  std::size_t uncovered = 0;
  for (const TunerLine& line : comparison.lines)
    for (const TunerPoint& point : line.points)
      for (const double regret : {point.worst_regret.mean, point.worst_regret.worst})
        uncovered += std::isinf(regret) ? 1U : 0U;
  EXPECT_THAT(body, has("above", uncovered));
  EXPECT_THAT(body, has("tick", "#9aa5b1"));
  EXPECT_THAT(body, has("printed", "#5b6570"));
  EXPECT_THAT(body, has("hypervolume", fmt::format("{:.4f}", comparison.lines[0].points[1].hypervolume.mean)));
  EXPECT_THAT(body, HasSubstr(fmt::format("{} settings, {} with missed_rate to 0.5", 61, comparison.feasible)));
}

/// Everything in it is shown; nothing in it runs or becomes an element.
const char* const kEverythingOpen = R"(
  for (const part of document.querySelectorAll('details')) part.open = true;
  for (const button of document.querySelectorAll('main button')) button.click();
  result.elements = document.querySelectorAll('img[src=x], main script').length;
  result.told = document.body.textContent.split('dataset.hacked = 1').length > 3;
)";
void expect_harmless(const std::string& body) {
  expect_drawn(body);
  EXPECT_THAT(body, Not(HasSubstr("data-hacked")));
  EXPECT_THAT(body, has("elements", 0));
  EXPECT_THAT(body, has("told", "true"));
}

// As the report (ReportInBrowser) and the trend page (TrendInBrowser) do.
TEST_F(PagesInBrowser, HostileNamesAreTexts) {
  const auto shown = [&](const std::filesystem::path& page, const std::set<std::string_view>& kept) {
    SCOPED_TRACE(page.string());
    expect_harmless(body_tag(document(hostile_page(read_file(page), kept), kEverythingOpen)));
  };
  shown(write_hand_made_stress(folder_ / "stress") / kStressPage, {"flat", "cone"});

  const std::filesystem::path run = null_sweep(folder_);
  write_tune_page(replay_tune(run, "", {.quiet = true}), folder_.path());
  shown(folder_ / std::string(kTunePage), {"setting"});

  write_tuners_page(compare_tuners(load_recorded(run, {}), {.seeds = 2, .shares = {0.5}}), folder_ / "tuners.html");
  shown(folder_ / "tuners.html", {});

  std::ofstream(folder_ / "scene.json") << R"({
    "scenes": [{"heightmap": {"source": "fbm", "width": 16, "height": 16}, "views": "oblique", "frame_px": [32, 32],
                "light": {"elevation_deg": 60, "azimuth_deg": 140}}],
    "visible": "flip<=0.5", "features": {"shadow": ["linear"], "lod": [], "fade": [], "normals": []},
    "measure": {"samples": 1}})";
  write_require(run_require(load_scene_file(folder_ / "scene.json"), {.backend = "null", .quiet = true}),
                folder_.path());
  shown(folder_ / std::string(kRequirePage), {"with", "without", "reference"});
}

}  // namespace
}  // namespace reliefbench
