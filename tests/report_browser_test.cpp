// The report as a browser draws it: what it answers, and what it does with mouse, keyboard and links.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>

#include "kernels/image/image.h"
#include "kernels/judge/heat_map.h"
#include "reports/pages/report.h"
#include "tests/browser.h"
#include "tests/synthetic_run.h"
#include "tuner/decide/pareto.h"
#include "tuner/decide/recommend.h"
#include "tuner/results/run_files.h"

namespace reliefbench {
namespace {

using nlohmann::json;
using testing::Contains;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

using ReportInBrowser = InBrowser;

std::string report_of(const Run& run) { return make_report(std::span(&run, 1)); }

/// What a probe left as JSON in result.NAME.
json told(const std::string& body, const std::string& name) {
  std::smatch found;
  if (!std::regex_search(body, found, std::regex("data-" + name + "=\"([^\"]*)\""))) return {};
  return json::parse(std::regex_replace(found[1].str(), std::regex("&quot;"), "\""), nullptr, false);
}

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
  run.info["argv"] = {"reliefbench", "sweep", "my config.json", "-o", "out", "--pictures", "none"};
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
    result.probed = 'yes';
  )";
  const std::string body = body_tag(document(report_of(run), probe));
  expect_drawn(body);
  EXPECT_THAT(body, has("probed", "yes"));
  EXPECT_THAT(body, has("points", 360));
  EXPECT_THAT(body, has("cards", 3));
  EXPECT_THAT(body, has("missing", "reliefbench sweep 'my config.json' -o out"));
  for (const char* name :
       {"sentences", "moved", "limit", "within", "back", "filtered", "answersfiltered", "searched", "hidden",
        "restored", "hovered", "unhovered", "active", "falling", "exact", "effects", "looks"})
    EXPECT_THAT(body, has(name, "true")) << name;
  EXPECT_THAT(body, HasSubstr("data-fragment=\"#error="));
  EXPECT_THAT(body, HasSubstr(" time_ms="));
  EXPECT_THAT(body, has("pins", 2));
  // A folder of its own: another point's command is not refused.
  EXPECT_THAT(body, ContainsRegex("data-command=\"reliefbench sweep 'configs/quick start.json' -o out/[0-9a-f]{8} "));
  EXPECT_THAT(body, HasSubstr("--filter '*@rocks/oblique?*' --backend"));
  EXPECT_THAT(body, has("rows", 40));
  // Every column that a metric says it is, by its own id.
  const auto columns = told(body, "columns").get<std::vector<std::string>>();
  for (const MetricRow& metric : metrics())
    if (metric.is_column()) {
      EXPECT_THAT(columns, Contains(StartsWith(std::string(metric.id))));
    }
  EXPECT_THAT(body, has("csv", "121 true"));
  EXPECT_THAT(body, has("axis", "psnr (dB), better downwards"));
  EXPECT_THAT(body, HasSubstr("data-scene=\"rocks/grazing #metric=psnr scene=1"));
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

/// A picture in which every pixel says where it is.
std::vector<std::uint8_t> marked_picture(int side, std::uint8_t blue) {
  std::vector<std::uint8_t> rgba8;
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x)
      for (const int code : {x / 2, y / 2, static_cast<int>(blue), 255})
        rgba8.push_back(static_cast<std::uint8_t>(code));
  return rgba8;
}

TEST_F(ReportInBrowser, PicturesSplitBlinkZoomAndTellTheirPixels) {
  constexpr int kSide = 512;
  reliefbench::Run run =
      synthetic_run({.folder = folder_ / "run", .backends = {"vulkan"}, .scenes = {"rocks/oblique"}});
  std::filesystem::create_directories(folder_ / "run" / "images");
  const Answer answer =
      recommend(run.records, {.budgets = {parse_budget("e_xy.p99<=0.5"), parse_budget("missed_rate<=0.001")}}).front();
  ASSERT_TRUE(answer.pick && answer.just_fails);
  std::vector<std::uint8_t> error(static_cast<std::size_t>(4 * kSide * kSide), 255);
  std::vector<std::uint8_t> taps = error;
  for (std::size_t i = 0; i < error.size(); i += 4) {
    std::ranges::copy(heat_map_legend().stops[6].color, error.begin() + static_cast<std::ptrdiff_t>(i));
    std::ranges::copy(taps_map_legend().stops[3].color, taps.begin() + static_cast<std::ptrdiff_t>(i));
  }
  for (const Record* record : {answer.pick, answer.just_fails}) {
    write_png(run.folder / image_path(record->case_id, "frame"), kSide, kSide, marked_picture(kSide, 10));
    write_png(run.folder / image_path(record->case_id, "error"), kSide, kSide, error);
    write_png(run.folder / image_path(record->case_id, "taps"), kSide, kSide, taps);
    write_png(run.folder / image_path(reference_image_key(record->scene, record->backend, record->case_id), "frame"),
              kSide, kSide, marked_picture(kSide, 200));
  }
  const std::string probe = R"(
    const press = (key, target = document.body) => target.dispatchEvent(new KeyboardEvent('keydown', {key, bubbles: true}));
    const point = () => { const box = byId('stage').querySelector('.pane-picture').getBoundingClientRect();
      byId('stage').querySelector('.pane-picture').dispatchEvent(new PointerEvent('pointermove', {bubbles: true,
        clientX: box.left + box.width * 0.25, clientY: box.top + box.height * 0.75})); return byId('pixel').textContent; };
    result.strip = [...document.querySelectorAll('.strip-card .note')].map((n) => n.textContent).join();
    result.panes = document.querySelectorAll('#stage .pane img').length;
    document.querySelector('#stage .divider').dispatchEvent(new KeyboardEvent('keydown', {key: 'ArrowRight', bubbles: true}));
    result.split = byId('stage').style.getPropertyValue('--split');
    press('b');
    result.blink = byId('stage').className;
    press('b');
    point();  // decodes
    setTimeout(() => {
      result.pixel = point();
      press('+'); press('+');
      result.zoom = byId('stage').dataset.zoom + ' ' + new Set([...document.querySelectorAll('#stage .pane img')].map((i) => i.style.transform)).size;
      result.zoomed = point();
      press('0');
      press('2');
      result.kind = document.querySelector('#stage figcaption').parentElement.parentElement.querySelector('.over figcaption').textContent;
      result.legend = document.querySelectorAll('#heat-legend .ramp').length;
      press('a');
      result.all = document.querySelectorAll('#stage .pane img').length + ' ' + document.querySelectorAll('#heat-legend .ramp').length;
      press('d');
      const fails = [...document.querySelectorAll('.strip-card')].find((c) => c.textContent.includes('just fails'));
      choose({other: stripEntries().find(({notes}) => notes.includes('just fails')).index});
      result.side = [...document.querySelectorAll('#stage figcaption')].length + ' ' + new Set([...document.querySelectorAll('#stage img')].map((i) => i.alt)).size;
      fails.click();
      result.shown = String(shownPicture() === stripEntries().find(({notes}) => notes.includes('just fails')).index);
      const pick = stripEntries().find(({notes}) => notes.includes('pick')).index;
      showHover(pick, 10, 10, plotted.chart);
      result.thumbnail = document.querySelectorAll('#hover img').length;
      choose({pins: [pick, choice.picture]});
      result.pinned = document.querySelectorAll('#pins .thumb img').length;
    }, 300);
  )";
  const std::string body = body_tag(document(report_of(run), probe));
  expect_drawn(body);
  EXPECT_THAT(body, HasSubstr("just fails"));
  EXPECT_THAT(body, HasSubstr("pick"));
  EXPECT_THAT(body, has("panes", 2));
  EXPECT_THAT(body, has("split", "52%"));
  EXPECT_THAT(body, has("blink", "stage mode-split other"));
  EXPECT_THAT(body, HasSubstr("pixel 128, 384 of 512 × 512: frame "));
  EXPECT_THAT(body, HasSubstr("error 1.0 texels · taps 8.0 taps"));
  EXPECT_THAT(body, has("zoom", "4.00 1"));  // and all pictures alike
  EXPECT_THAT(body, HasSubstr("data-zoomed=\"pixel 224, 288 of"));
  EXPECT_THAT(body, HasSubstr(": error map\""));
  EXPECT_THAT(body, has("legend", 1));
  EXPECT_THAT(body, has("all", "4 2"));
  EXPECT_THAT(body, has("side", "2 2"));
  EXPECT_THAT(body, has("thumbnail", 1));
  EXPECT_THAT(body, has("pinned", 2));
  EXPECT_THAT(body, has("shown", "true"));
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
  )"));
  expect_drawn(body);
  EXPECT_THAT(body, Not(HasSubstr("data-owned")));
  EXPECT_THAT(body, has("elements", 0));
  EXPECT_THAT(body, has("formula", 0));
  EXPECT_THAT(body, has("wide", "false"));
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
  EXPECT_LT(figure("elements"), 4000) << "an element a case is slow anywhere";
}

// To be looked at: build/screenshots/report_*.png.
TEST_F(ReportInBrowser, FitsItsScreensAndLeavesPictures) {
  const std::filesystem::path folder = std::filesystem::path(RELIEFBENCH_SOURCE_DIR) / "build" / "screenshots";
  std::filesystem::create_directories(folder);
  const std::string html = report_of(synthetic_run({}));
  for (const bool is_dark : {false, true})
    for (const int width_px : {1280, 390}) {
      const std::string probe = R"(
        result.wide = document.documentElement.scrollWidth > document.documentElement.clientWidth;
        result.height = document.documentElement.scrollHeight;
        result.ink = getComputedStyle(document.body).color;
      )";
      const std::string body =
          body_tag(document(html, probe, {.fragment = "pins=3,70", .width_px = width_px, .is_dark = is_dark}));
      EXPECT_THAT(body, has("wide", "false")) << width_px;
      EXPECT_THAT(body, has("ink", is_dark ? "rgb(232, 235, 239)" : "rgb(27, 31, 36)"));
      if (width_px == 1280) {
        EXPECT_LT(told(body, "height"), 4 * 900);
      }
      const std::filesystem::path picture =
          folder / fmt::format("report_{}_{}.png", width_px, is_dark ? "dark" : "light");
      std::filesystem::remove(picture);
      screenshot(html, picture,
                 {.fragment = "pins=3,70",
                  .width_px = width_px,
                  .height_px = width_px == 390 ? 5200 : 3000,
                  .is_dark = is_dark});
      EXPECT_TRUE(std::filesystem::exists(picture) && std::filesystem::file_size(picture) > 20000) << picture;
    }
}

}  // namespace
}  // namespace reliefbench
