// The report as a browser draws it: what it answers, and what it does with mouse, keyboard and links.
#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "tests/report_probe.h"
#include "tests/synthetic_run.h"
#include "tuner/decide/pareto.h"
#include "tuner/decide/recommend.h"

namespace reliefbench {
namespace {

using nlohmann::json;
using testing::Contains;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::StartsWith;

using ReportInBrowser = InBrowser;

/// The records behind the page's points, in their order.
std::vector<const Record*> measured_of(const Run& run) {
  std::vector<const Record*> points;
  for (const Record& record : run.records)
    if (record.status == Status::ok && record.frame_time && record.error) points.push_back(&record);
  return points;
}

json index_of(const std::vector<const Record*>& points, const Record* record) {
  if (record == nullptr) return {};
  return std::ranges::find(points, record) - points.begin();
}

// The page decides by itself, as its budgets move: by the same rules as the commands.
TEST_F(ReportInBrowser, DecidesAsTheCommandsDo) {
  reliefbench::Run run = synthetic_run({.cases = 150});
  // Wide intervals make ties, which the simplest of them must win.
  for (Record& record : run.records)
    if (record.frame_time) {
      Summary& time = record.frame_time->summary;
      time.ci_low = time.median * (record.memory_bytes % 2 == 0 ? 0.8 : 0.97);
      record.memory_bytes = 65536 * static_cast<std::int64_t>(1 + record.case_id.size() % 3);
    }
  const std::string probe = R"(
    const answers = (fields) => { choose(fields); return data.scenes.flatMap((_, scene) => groupsOf(scene).map((group) => {
      const {pick, tie, ties, flat, nearest, justFails, accurate} = answerOf(scene, group);
      return [sceneName(scene), data.groups[group].backend, pick, tie, ties, flat, nearest, justFails, accurate]; })); };
    result.own = JSON.stringify(answers({}));
    result.strict = JSON.stringify(answers({error: 0.01}));
    result.none = JSON.stringify(answers({error: -1}));
    result.time = JSON.stringify(answers({error: undefined, time_ms: 1.5}));
    choose({time_ms: null});
    result.fronts = JSON.stringify(data.metrics.map((_, metric) => data.scenes.map((_, scene) =>
        groupsOf(scene).map((group) => frontOf(pointsIn(scene, group), metric, constraintsOf(group))))));
  )";
  const std::string body = body_tag(document(report_of(run), probe));
  expect_drawn(body);
  const std::vector<const Record*> points = measured_of(run);
  const auto expect_answers = [&](const std::string& name, const Question& question, bool is_of_time) {
    const json found = told(body, name);
    const std::vector<Answer> answers = recommend(run.records, question);
    ASSERT_EQ(found.size(), answers.size()) << name;
    for (const Answer& answer : answers) {
      const auto row = std::ranges::find_if(
          found, [&](const json& one) { return one[0] == answer.scene && one[1] == answer.backend; });
      ASSERT_NE(row, found.end());
      if (is_of_time) {
        EXPECT_EQ((*row)[8], index_of(points, answer.pick)) << name << *row;
        continue;
      }
      const json expected = {
          index_of(points, answer.pick), index_of(points, answer.tie),     answer.ties,
          index_of(points, answer.flat), index_of(points, answer.nearest), index_of(points, answer.just_fails)};
      EXPECT_EQ(json(row->begin() + 2, row->begin() + 8), expected) << name << *row;
    }
  };
  const Budget missed = parse_budget("missed_rate<=0.001");
  expect_answers("own", {.budgets = {parse_budget("e_xy.p99<=0.5"), missed}}, false);
  expect_answers("strict", {.budgets = {parse_budget("e_xy.p99<=0.01"), missed}}, false);
  expect_answers("none", {.budgets = {parse_budget("e_xy.p99<=-1"), missed}}, false);
  expect_answers("time", {.budgets = {missed}, .max_time_ms = 1.5}, true);

  const json drawn = told(body, "fronts");
  ASSERT_EQ(drawn.size(), metrics().size());
  const std::vector<Budget> constraints = {missed};
  std::size_t points_on_fronts = 0;
  for (std::size_t m = 0; m < metrics().size(); ++m) {
    if (!metrics()[m].lower_is_better) continue;
    std::map<std::pair<std::string, std::string>, json> of_page;
    for (const json& scene : drawn[m])
      for (const json& front : scene)
        if (!front.empty()) {
          const Record& first = *points[front[0].get<std::size_t>()];
          of_page[{first.scene, first.backend}] = front;
        }
    for (const Front& front : fronts(run.records, metrics()[m].id, constraints)) {
      json expected = json::array();
      for (const FrontPoint& point : front.points) expected.push_back(index_of(points, point.record));
      const json found =
          of_page.contains({front.scene, front.backend}) ? of_page[{front.scene, front.backend}] : json::array();
      EXPECT_EQ(found, expected) << metrics()[m].id << " " << front.scene;
      points_on_fronts += expected.size();
    }
  }
  EXPECT_GT(points_on_fronts, 50U);
}

TEST_F(ReportInBrowser, AnswersToMouseAndKeyboard) {
  reliefbench::Run run = synthetic_run({});
  run.info["argv"] = {"reliefbench", "sweep", "my config.json", "-o", "out", "--pictures", "none", "--frame-px=720p"};
  const std::string probe = R"(
    const press = (target, key) => target.dispatchEvent(new KeyboardEvent('keydown', { key, bubbles: true }));
    const set = (element, value, type) => { element.value = value; element.dispatchEvent(new Event(type, {bubbles: true})); };
    const text = (selector) => document.querySelector(selector).textContent;
    result.cards = document.querySelectorAll('#answer-cards .card').length;
    result.sentences = String([...document.querySelectorAll('.answer .sentence')].every((p) => /steps|quad|parallax|flat/.test(p.textContent)));
    result.missing = text('#stage code');
    // The sliders move the picks and the lines.
    const picks = () => [...document.querySelectorAll('#answer-cards .price strong')].map((s) => s.textContent).join();
    const before = picks();
    const slider = byId('error-limit');
    set(slider, 40, 'input');
    result.moved = String(picks() !== before);
    result.limit = String(choice.error !== undefined && plotted.marks.budgets.error.text.includes('≤'));
    set(byId('time-limit'), 200, 'input');
    result.within = String(document.body.textContent.includes('Within time'));
    result.fragment = location.hash.replaceAll('&', ' ');
    [...document.querySelectorAll('#budgets button')].at(-1).click();
    result.back = String(picks() === before && location.hash.length < 2);
    // Filters.
    const all = plotted.dots.length;
    set(document.querySelector('#filters select[name=format]'), 'rg16', 'change');
    result.filtered = String(plotted.dots.length > 0 && plotted.dots.every((i) => paramOf(data.points[i], 'format') === 'rg16'));
    result.answersfiltered = String(text('#budget').includes('of what the filters leave'));
    [...document.querySelectorAll('#filters button')].at(-1).click();
    set(byId('search'), 'vulkan cone_steps', 'input');
    result.searched = String(plotted.dots.length > 0 && plotted.dots.length < all && plotted.dots.every((i) => data.groups[data.points[i].group].backend === 'vulkan'));
    set(byId('search'), '', 'input');
    document.querySelectorAll('#technique-legend button')[1].click();
    result.hidden = String(plotted.dots.length < all && choice.hidden.size === 1);
    document.querySelectorAll('#technique-legend button')[1].click();
    result.restored = String(plotted.dots.length === all);
    // Several pins, by keyboard and by mouse.
    const canvas = byId('plot');
    press(canvas, 'ArrowRight');
    result.hovered = String(!byId('hover').hidden && byId('hover').textContent.includes('flat'));
    press(canvas, 'Enter');
    press(canvas, 'ArrowRight');
    press(canvas, 'ArrowRight');
    press(canvas, 'Enter');
    result.active = String(plotted.marks.active !== null);
    press(canvas, 'Escape');
    result.pins = document.querySelectorAll('#pins thead th').length;
    result.command = [...document.querySelectorAll('#pins .command-line code')].at(-1).textContent;
    result.unhovered = String(byId('hover').hidden);
    // The table and its CSV.
    byId('table').open = true;
    drawTable();
    const rows = () => [...document.querySelectorAll('#table-rows tbody tr')].map((row) => row.textContent);
    const rising = rows();
    result.columns = JSON.stringify([...document.querySelectorAll('#table-rows th button')].map((b) => b.textContent));
    result.rows = rising.length;
    [...document.querySelectorAll('#table-rows th button')].find((b) => b.textContent.startsWith('Time')).click();
    result.falling = String(rows()[0] !== rising[0] && document.querySelector('#table-rows th[aria-sort=descending]') !== null);
    const lines = csvText().trim().split('\r\n');
    result.csv = lines.length + ' ' + (lines[0].split(',').length > 30);
    // Another metric, where higher is better and some pictures are identical.
    set(byId('metric'), [...data.metrics.keys()].find((i) => data.metrics[i].none_is_best), 'change');
    result.axis = plotted.chart.options.scales.y.title.text;
    const {axis} = plotted;
    const exact = plotted.dots.filter((i) => data.points[i].errors[choice.metric] === null);
    result.exact = String(exact.length > 0 && exact.every((i) => axis.place(null) < axis.band.top));
    document.querySelectorAll('#scenes button')[1].click();
    result.scene = sceneName(choice.scene) + ' ' + location.hash.replaceAll('&', ' ');
    result.effects = String(document.querySelectorAll('#effect-rows tbody tr').length > 3);
    byId('environment').open = true;
    window.dispatchEvent(new Event('beforeprint'));
    window.dispatchEvent(new Event('afterprint'));
    result.unlabelled = [...document.querySelectorAll('button, input, select, img, canvas:not([aria-hidden])')].filter((e) => !(e.textContent.trim() ||
        e.getAttribute('aria-label') || e.getAttribute('alt') !== null || e.closest('label') || document.querySelector(`label[for="${e.id}"]`))).length;
    result.looks = new Set(usedTechniques.map((t) => seriesOf(t) % kColors + shapeOf(seriesOf(t)))).size === usedTechniques.length;
    const theme = readTheme();
    const many = [...data.techniques, ...'abcdef'].map((_, series) => `${theme.series[series % kColors]} ${shapeOf(series)}`);
    result.pairs = String(new Set(many).size === many.length && new Set(theme.series).size === kColors);
    result.probed = 'yes';
  )";
  const std::string body = body_tag(document(report_of(run), probe));
  expect_drawn(body);
  EXPECT_THAT(body, has("probed", "yes"));
  EXPECT_THAT(body, has("points", 360));
  EXPECT_THAT(body, has("cards", 3));
  EXPECT_THAT(body, has("missing", "reliefbench sweep 'my config.json' -o out --frame-px=720p"));
  for (const char* name :
       {"sentences", "moved", "limit", "within", "back", "filtered", "answersfiltered", "searched", "hidden",
        "restored", "hovered", "unhovered", "active", "falling", "exact", "effects", "looks", "pairs"})
    EXPECT_THAT(body, has(name, "true")) << name;
  EXPECT_THAT(body, HasSubstr("data-fragment=\"#error="));
  EXPECT_THAT(body, HasSubstr(" time_ms="));
  EXPECT_THAT(body, has("pins", 2));
  // A folder of its own: another point's command is not refused.
  EXPECT_THAT(body, ContainsRegex("data-command=\"reliefbench sweep 'configs/quick start.json' -o out/[0-9a-f]{8} "));
  EXPECT_THAT(body, ContainsRegex("--filter '\\*@rocks/oblique\\?\\*' --backend [a-z]+ --frame-px 720p"));
  EXPECT_THAT(body, has("rows", 40));
  // Every column that a metric says it is, by its own id.
  const auto columns = told(body, "columns").get<std::vector<std::string>>();
  for (const MetricRow& metric : metrics())
    if (metric.is_column()) {
      EXPECT_THAT(columns, Contains(StartsWith(std::string(metric.id))));
    }
  EXPECT_THAT(body, has("csv", "121 true"));
  EXPECT_THAT(body, has("axis", "psnr (dB), better downwards"));
  EXPECT_THAT(body, HasSubstr("data-scene=\"rocks/grazing #metric=psnr scene=rocks/grazing "));
  EXPECT_THAT(body, has("unlabelled", 0));
}

TEST_F(ReportInBrowser, AFragmentShowsTheSameAgain) {
  const reliefbench::Run run = synthetic_run({.cases = 20});
  const std::string probe = R"(
    result.state = [choice.scene, choice.group, choice.error, choice.time_ms, [...choice.hidden].length, choice.pins.join('+'),
                    choice.mode, data.metrics[choice.metric].id, choice.search].join(' ');
    location.hash = 'scene=2';
    window.dispatchEvent(new Event('hashchange'));
    result.after = choice.scene + ' ' + choice.pins.length + document.querySelector('#scenes [aria-pressed=true]').textContent;
  )";
  const std::string body = body_tag(document(report_of(run), probe,
                                             {.fragment = "scene=1&group=1&error=0.25&time_ms=3&hidden=relief,nonsense&"
                                                          "pins=1,5,99999,x&mode=side&metric=flip&search=cone"}));
  expect_drawn(body);
  EXPECT_THAT(body, has("state", "1 1 0.25 3 1 1+5 side flip cone"));
  EXPECT_THAT(body, has("after", "2 0spikes/grazing"));
}

TEST_F(ReportInBrowser, ComparesTheDevicesOfSeveralRuns) {
  const std::vector<reliefbench::Run> runs = {
      synthetic_run({.folder = "a", .device = "Slow GPU", .backends = {"vulkan"}, .cases = 60, .slowness = 4}),
      synthetic_run({.folder = "b", .device = "Fast GPU", .backends = {"vulkan"}, .cases = 60})};
  const std::string body = body_tag(document(make_report(runs), R"(
    result.fronts = plotted.fronts.length;
    result.labels = plotted.marks.fronts.map(({label}) => label).join();
    // One device's cards are those of the other: the same settings, four times as slow.
    result.merged = Math.max(...[...document.querySelectorAll('.answer')].map((a) => a.querySelectorAll('.price').length));
    const device = document.querySelector('#filters select[name=group]');
    device.value = '1';
    device.dispatchEvent(new Event('change'));
    result.one = plotted.fronts.length + ' ' + plotted.dots.length;
    result.fleet = byId('fleet-rows').textContent;
  )"));
  expect_drawn(body);
  EXPECT_THAT(body, has("fronts", 2));
  EXPECT_THAT(body, has("labels", "front, Slow GPU (vulkan),front, Fast GPU (vulkan)"));
  EXPECT_THAT(body, has("merged", 2));
  EXPECT_THAT(body, has("one", "1 60"));
  EXPECT_THAT(body, HasSubstr("No setting for all: "));  // made-up runs have no samples
}

}  // namespace
}  // namespace reliefbench
