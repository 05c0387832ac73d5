// The trend page as a browser draws it, and what it does as readers go about in it.
#include <cmath>
#include <nlohmann/json.hpp>

#include "reports/pages/trend_page.h"
#include "tests/browser.h"
#include "tests/hostile_page.h"
#include "tests/made_trend.h"

namespace reliefbench {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

class TrendInBrowser : public InBrowser {
 protected:
  /// probe: the body of an async function with some helpers; `go` follows a link and waits until its view is there.
  [[nodiscard]] std::string body_of(const json& data, const std::string& probe, const Opening& opening = {}) const {
    const std::string helpers = R"(
      const all = (selector) => [...document.querySelectorAll(selector)];
      const texts = (selector) => all(selector).map((element) => element.textContent).join('|');
      const moment = () => new Promise((resolve) => setTimeout(resolve, 200));
      const go = async (link) => { (link.click ? link : document.querySelector(link)).click(); await moment(); };
      const enter = (control, value) => {
        control.value = value;
        control.dispatchEvent(new Event(control.tagName === 'SELECT' ? 'change' : 'input'));
      };
      const press = (target, key) =>
          target.dispatchEvent(new KeyboardEvent('keydown', {key, bubbles: true, cancelable: true}));
      const view = () => all('main > section').filter((section) => !section.hidden).map(({id}) => id).join();
      const dots = (place) => Chart.getChart(document.querySelector(`${place} canvas`)).data.datasets[0].data;
      const place = () => location.hash.replaceAll('&', ' ');
      const sideways = () =>
          document.scrollingElement.scrollWidth - document.scrollingElement.clientWidth;
    )";
    return body_tag(document(
        trend_page(data), fmt::format("(async () => {{ {} {} result.probed = 'yes'; }})();", helpers, probe), opening));
  }
  static void expect_probed(const std::string& body) {
    expect_drawn(body);
    EXPECT_THAT(body, has("probed", "yes"));
  }
};

TEST_F(TrendInBrowser, AnswersFirstAndTheWorstConfirmedComesFirst) {
  const json data = made_trend();
  const std::string body = body_of(data, R"(
    result.verdict = texts('#verdict .headline');
    result.groups = texts('#events h2');
    result.effects = texts('#events .effect strong');
    result.sparks = all('.event-row .spark').length;
    const first = document.querySelector('.event-row');
    result.first = first.querySelector('.effect').textContent + first.querySelector('.what').textContent;
    result.facts = [...first.querySelectorAll('.facts-line')].map((line) => line.textContent).join('|');
    result.copies = first.querySelector('.copy').title;
    result.folded = String(!document.querySelector('details.event-group').open);
  )");
  expect_probed(body);
  EXPECT_THAT(body, has("verdict", "▲1 regression, 2 suspects, 1 improvement378 series on 2 machines, 40 nights"));
  EXPECT_THAT(body, has("groups",
                        "Confirmed regressions (1)|Suspects (2)|Improvements (1)|Errors changed (1)|"
                        "Moved with the machine (1)|Accepted and cleared (2)"));
  EXPECT_THAT(body, has("effects",
                        "▲5.2 % slower|▲3 % slower, drifting|▲2.7 % slower|▼3.8 % faster|◆errors changed|▲6.1 % slower|"
                        "▲3.1 % slower|▲1.9 % slower"));
  EXPECT_THAT(body, has("sparks", 7));  // none of changed errors: times did not move
  EXPECT_THAT(body, has("first", "▲5.2 % slower4.7 to 5.7 %vulkan technique=relaxed_cone"));
  const json& event = data["events"][0];
  const auto commit = [&](int i) { return event["commits"][i].get<std::string>(); };
  EXPECT_THAT(body, HasSubstr(fmt::format("data-facts=\"confirmedci-7{} seriesq 1e−9|since ", event["series"].size())));
  EXPECT_THAT(body, HasSubstr(commit(0).substr(0, 8) + ".." + commit(1).substr(0, 8)));
  EXPECT_THAT(body, has("copies", fmt::format("git log {}..{}", commit(0), commit(1))));
  EXPECT_THAT(body, has("folded", "true"));
}

TEST_F(TrendInBrowser, AnEventShowsItsSeriesLargeAndSmallAndTheBackButtonGoesBack) {
  const json data = made_trend();
  const std::string body = body_of(data, R"(
    await go('.event-row .what');
    result.place = place();
    result.view = view();
    result.heading = document.activeElement.textContent;
    result.history = texts('#event-head .history .pill');
    result.dots = dots('#event-series').length;
    result.kinds = [...new Set(dots('#event-series').map(({kind}) => kind))].sort().join();
    result.control = Chart.getChart(document.querySelector('#event-series .control-box canvas')).data.datasets[0].data.length;
    result.multiples = all('.multiple').length;
    result.smallsparks = all('.multiple .spark').length;
    const third = all('.multiple')[2];
    await go(third);
    result.chosen = String(third.getAttribute('aria-current') === 'true' && all('.multiple[aria-current]').length === 1);
    result.named = String(texts('#event-series .series-name') === third.querySelector('strong').textContent);
    history.back();
    await moment();
    result.back1 = place();
    history.back();
    await moment();
    result.back2 = view();
  )");
  expect_probed(body);
  EXPECT_THAT(body, has("place", "#view=event event=1"));
  EXPECT_THAT(body, has("view", "event"));
  EXPECT_THAT(body, has("heading", "vulkan technique=relaxed_cone"));
  EXPECT_THAT(body, has("history", "suspect|confirmed|note"));
  EXPECT_THAT(body, has("dots", 40));
  EXPECT_THAT(body, HasSubstr("missing,night"));  // a night of the whole machine was not looked at
  EXPECT_THAT(body, has("control", 40));
  EXPECT_THAT(body, has("multiples", data["events"][0]["series"].size()));
  EXPECT_THAT(body, has("smallsparks", data["events"][0]["series"].size()));
  EXPECT_THAT(body, has("chosen", "true"));
  EXPECT_THAT(body, has("named", "true"));
  EXPECT_THAT(body, has("back1", "#view=event event=1"));
  EXPECT_THAT(body, has("back2", "overview"));
}

TEST_F(TrendInBrowser, SeriesAreSearchedFilteredAndChosenByKeyboard) {
  const json data = made_trend();
  const auto count = [&](auto&& holds) { return std::ranges::count_if(data["series"], holds); };
  const std::string body = body_of(data, R"(
    await go('nav a[href="#view=series"]');
    result.listed = all('.series-link').length;
    await go('#series-list .more');
    result.more = all('.series-link').length;
    result.refocused = [...all('.series-link')].indexOf(document.activeElement);
    const changes = all('.series-link .change').map((element) => Math.abs(parseFloat(element.textContent.replace(/[^\d.]/g, '')) || 0));
    result.sorted = String(changes.every((change, i) => i === 0 || change <= changes[i - 1]));
    enter(document.querySelector('#filters select[name=technique]'), 'cone');
    result.filtered = texts('#series-count');
    enter(document.querySelector('#filters input'), 'grazing RG16');
    result.searched = texts('#series-count');
    await moment();
    result.place = place();
    result.first = String(texts('.series-name') === texts('.series-link[aria-current] strong'));
    const before = document.querySelector('.series-link');
    before.focus();
    press(before, 'ArrowDown');
    result.second = [...all('.series-link')].indexOf(document.activeElement);
    await go(document.activeElement);
    result.kept = [...all('.series-link')].indexOf(document.activeElement);
    result.chosen = String(dots('#series-shown').length) + texts('.series-link[aria-current] strong');
    const canvas = document.querySelector('#series-shown canvas');
    press(canvas, 'ArrowRight');
    press(canvas, 'ArrowRight');
    const {title, body} = Chart.getChart(canvas).tooltip;
    result.tooltip = `${title} ${body.map(({lines}) => lines).flat().join('; ')}`;
    const table = document.querySelector('#series-shown details');
    table.open = true;
    await moment();
    result.rows = table.querySelectorAll('tbody tr').length;
    enter(document.querySelector('#filters input'), 'no such thing');
    await moment();
    result.none = texts('#series-shown');
    await go('#filters button');
    result.cleared = `${texts('#series-count')} ${place()}`;
  )");
  expect_probed(body);
  EXPECT_THAT(body, has("listed", 50));
  EXPECT_THAT(body, has("more", 100));
  EXPECT_THAT(body, has("refocused", 50));
  EXPECT_THAT(body, has("sorted", "true"));
  const auto of_cone = [](const json& s) { return s["technique"] == "cone"; };
  const auto found = [&](const json& s) {
    return of_cone(s) && s["format"] == "rg16" && s["scene"].get<std::string>().ends_with("grazing");
  };
  EXPECT_THAT(body, HasSubstr(fmt::format("data-filtered=\"{} of 378 series", count(of_cone))));
  EXPECT_THAT(body, HasSubstr(fmt::format("data-searched=\"{} of 378 series", count(found))));
  EXPECT_THAT(body, has("place", "#view=series search=grazing+RG16 technique=cone"));
  EXPECT_THAT(body, has("first", "true"));
  EXPECT_THAT(body, has("second", 1));
  EXPECT_THAT(body, has("kept", 1));
  EXPECT_THAT(body, HasSubstr("data-chosen=\"40cone cone_steps="));
  EXPECT_THAT(body, HasSubstr("data-tooltip=\"26 Oct 2026, 0"));
  EXPECT_THAT(body, HasSubstr("(standard error); level "));
  EXPECT_THAT(body, has("rows", 40));
  EXPECT_THAT(body, has("none", "No series here: another search or filter may find one."));
  EXPECT_THAT(body, has("cleared", "378 of 378 series, by size of their last step #view=series"));
}

TEST_F(TrendInBrowser, ALinkShowsTheSame) {
  const std::string probe = R"(
    result.view = view();
    result.technique = document.querySelector('#filters select[name=technique]').value;
    result.search = document.querySelector('#filters input').value;
    result.current = texts('nav [aria-current]');
    result.series = document.querySelector('.series-link[aria-current]')?.dataset.series || 'none';
    result.head = texts('#event-head h2');
  )";
  const std::string series =
      body_of(made_trend(), probe, {.fragment = "view=series&search=rg8&technique=qdm&series=174"});
  expect_probed(series);
  EXPECT_THAT(series, has("view", "series"));
  EXPECT_THAT(series, has("technique", "qdm"));
  EXPECT_THAT(series, has("search", "rg8"));
  EXPECT_THAT(series, has("current", "Series"));
  EXPECT_THAT(series, has("series", 174));
  const std::string lost = body_of(made_trend(), probe, {.fragment = "view=event&event=99"});
  expect_probed(lost);
  EXPECT_THAT(lost, has("head", "No event 99 here"));
}

TEST_F(TrendInBrowser, ShowsEpochsChangesNotesAndWhetherTheMachineMoved) {
  const json data = made_trend();
  const std::string body = body_of(data, R"(
    await go([...all('.what')].find((link) => link.textContent === 'vulkan'));
    const picture = (place) => document.querySelector(place).parentNode;
    result.epochs = epochsOf(1).map(({from, to}) => `${from}-${to}`).join();
    result.rows = all('#event-series .table-box')[0].querySelectorAll('tbody tr').length;
    const control = Chart.getChart(document.querySelector('#event-series .control-box canvas'));
    const means = [control.data.datasets[0].data.slice(0, 22), control.data.datasets[0].data.slice(22)].map((half) => mean(half.map(({y}) => y)));
    result.moved = Math.round(means[1] - means[0]);
    const widths = all('#event-series canvas').map((canvas) => Chart.getChart(canvas).chartArea).map(({left, right}) => `${left} ${right}`);
    result.aligned = String(widths[0] === widths[1]);
    await go('nav a[href="#view=log"]');
    result.log = all('.log li').length;
    const times = data.events.flatMap(({states}) => states).concat(data.annotations).map(({time}) => time).sort();
    result.newest = String(texts('.log li:first-child .when') === formatMoment(times[times.length - 1]));
    await go('nav a[href="#view=machines"]');
    result.machines = texts('#machines article > h3');
    result.verdicts = texts('#machines .verdict');
    result.shift = texts('#machines .facts').includes('2.1 % would be found within 5 nights in 9 of 10 cases');
  )");
  expect_probed(body);
  EXPECT_THAT(body, has("epochs", "0-21,22-39"));
  EXPECT_THAT(body, has("rows", 2));
  EXPECT_THAT(body, has("moved", 6));
  EXPECT_THAT(body, has("aligned", "true"));
  EXPECT_THAT(body, has("log", 17));
  EXPECT_THAT(body, has("newest", "true"));
  EXPECT_THAT(body, has("machines", "ci-7|lab-gpu"));
  EXPECT_THAT(body, has("verdicts", "rejected|used|rejected|used|used|valid|used|valid"));
  EXPECT_THAT(body, has("shift", "true"));
}

// A drifting series has no level that it is on now, and what lies beyond the axis is drawn at its end.
TEST_F(TrendInBrowser, DriftsSpikesAndSeriesOfSeveralMetrics) {
  json data = made_trend({.series = 2, .nights = 11, .machines = 1, .eventful = false});
  json& one = data["series"][0];
  one["values"] = json::array();
  for (int night = 0; night < 11; ++night) one["values"].push_back(1e6 * std::pow(1.02, night - 5));
  one["values"][3] = 3e6;
  one["spikes"] = {3};
  one["invalid"] = json::array();
  one["levels"] = {{{"first", 0}, {"end", 11}, {"value", 1e6}, {"low", 0.99e6}, {"high", 1.01e6}}};
  one["drift"] = {{"per_night", 0.02}, {"low", 0.015}, {"high", 0.025}};
  for (const char* key : {"smallest_shift", "autocorrelation"}) one[key] = nullptr;
  for (const char* key : {"name", "setting", "scene", "backend", "machine", "device"})
    if (one.contains(key)) data["series"][1][key] = one[key];
  data["series"][1]["metric"] = "cpu_time";
  const std::string body = body_of(data, R"(
    location.hash = `view=series&series=${seriesId(0)}`;
    await moment();
    result.facts = texts('#series-shown .facts tr');
    const chart = Chart.getChart(document.querySelector('#series-shown canvas'));
    const {min, max} = chart.scales.y;
    const marks = chart.data.datasets[0].data;
    result.ends = String(marks[3].y === max && marks[3].beyond === 1 && marks.filter(({beyond}) => beyond).length === 1);
    result.inside = String(marks.every(({y}) => min <= y && y <= max));
    result.names = texts('.series-link strong');
  )");
  expect_probed(body);
  EXPECT_THAT(body, HasSubstr("Level now1.10 ms, where the drift has come to"));
  EXPECT_THAT(body, Not(HasSubstr("Smallest shift")));
  EXPECT_THAT(body, Not(HasSubstr("autocorrelation")));
  EXPECT_THAT(body, has("ends", "true"));
  EXPECT_THAT(body, has("inside", "true"));
  EXPECT_THAT(body, testing::ContainsRegex("data-names=\"[^|]*, frame time\\|[^|]*, cpu time\""));
}

constexpr const char* kEveryView = R"(
  const views = ['', 'view=event&event=1', 'view=event&event=4', 'view=series', 'view=machines', 'view=log'];
  const wide = [];
  for (const fragment of views) {
    location.hash = fragment;
    await moment();
    for (const details of all('details')) details.open = true;
    await moment();
    if (sideways() > 0) wide.push(`${fragment || 'overview'} ${sideways()}`);
  }
  result.wide = wide.join() || 'none';
  result.width = innerWidth;
)";

TEST_F(TrendInBrowser, FitsScreensOfEveryWidthInBothColourSchemes) {
  for (const int width : {1280, 390})
    for (const bool is_dark : {false, true}) {
      const std::string body = body_of(made_trend(), std::string(kEveryView) + R"(
        result.paper = getComputedStyle(document.body).backgroundColor;
        location.hash = 'view=series';
        await moment();
        const tick = () => Chart.getChart(document.querySelector('#series-shown canvas')).options.scales.y.ticks.color;
        result.tick = tick();
        window.dispatchEvent(new Event('beforeprint'));
        result.printed = tick();
      )",
                                       {.width_px = width, .is_dark = is_dark});
      expect_probed(body);
      EXPECT_THAT(body, has("width", width));
      EXPECT_THAT(body, has("wide", "none"));
      EXPECT_THAT(body, has("tick", is_dark ? "#9aa5b1" : "#5b6570"));
      EXPECT_THAT(body, has("printed", "#5b6570"));
      EXPECT_THAT(body, has("paper", is_dark ? "rgb(20, 23, 27)" : "rgb(255, 255, 255)"));
    }
}

TEST_F(TrendInBrowser, HostileNamesAreTexts) {
  const std::string body =
      body_of(hostile(made_trend(), {"time", "state", "kind", "last", "made", "unit"}), std::string(kEveryView) + R"(
    result.images = all('main img, main script').length;
    result.copies = all('.copy').length;
    result.title = String(texts('#subtitle').startsWith('<\/script><script>'));
  )",
              {.width_px = 390});
  expect_probed(body);
  EXPECT_THAT(body, Not(HasSubstr("data-hacked")));
  EXPECT_THAT(body, has("images", 0));
  EXPECT_THAT(body, has("copies", 0));  // what is no commit is no command either
  EXPECT_THAT(body, has("title", "true"));
  EXPECT_THAT(body, has("wide", "none"));
}

TEST_F(TrendInBrowser, HistoriesWithLittleInThem) {
  const std::string probe = std::string(kEveryView) + R"(
    result.verdict = texts('#verdict .headline');
    result.said = texts('#verdict');
    result.groups = all('.event-group').length;
    location.hash = 'view=series';
    await moment();
    result.shown = document.querySelector('#series-shown canvas') ? dots('#series-shown').map(({kind}) => kind).join() : texts('#series-shown');
  )";
  const std::string empty = body_of(made_trend({.series = 0, .nights = 0, .machines = 0}), probe);
  expect_probed(empty);
  EXPECT_THAT(empty, has("verdict", "No nights yet"));
  EXPECT_THAT(empty, has("shown", "No series yet."));

  const std::string first = body_of(made_trend({.series = 20, .nights = 1}), probe);
  expect_probed(first);
  EXPECT_THAT(first, HasSubstr("Too few nights to say which shift would be seen."));
  EXPECT_THAT(first, has("shown", "night"));

  const std::string calm = body_of(made_trend({.series = 1, .nights = 12, .machines = 1, .eventful = false}), probe);
  expect_probed(calm);
  EXPECT_THAT(calm, has("verdict", "✓Nothing moved1 series on 1 machine, 12 nights"));
  EXPECT_THAT(calm, HasSubstr("A shift of 2.1 % on ci-7 would be found within 5 nights in 9 of 10 cases."));
  EXPECT_THAT(calm, has("groups", 0));

  json invalid = made_trend({.series = 4, .nights = 3});
  for (json& series : invalid["series"]) {
    series["values"] = {nullptr, 1e6, nullptr};
    series["invalid"] = {0, 1, 2};
    series["levels"] = json::array();
  }
  const std::string body = body_of(invalid, probe);
  expect_probed(body);
  EXPECT_THAT(body, has("shown", "missing,left,missing"));
}

TEST_F(TrendInBrowser, EventsOfWhichLittleIsKnown) {
  json data = made_trend({.series = 200});
  json& lost = data["events"][0];  // and of a run that is not on the page
  lost["kind"] = "lost";
  for (const char* key : {"effect", "low", "high", "good_run", "bad_run"}) lost[key] = nullptr;
  lost["commits"] = {nullptr, nullptr};
  data["events"][1]["series"] = json::array();
  data["events"][2]["commits"] = {"v1.2", "v1.3"};
  const std::string body = body_of(data, std::string(kEveryView) + R"(
    await go('nav a');
    result.groups = texts('#events h2');
    result.first = texts('.event-row:first-child .effect').slice(0, 5) + all('.event-row')[0].querySelectorAll('.facts-line')[1].textContent;
    result.copies = all('.copy')[1].title;
    location.hash = 'view=event&event=1';
    await moment();
    result.when = texts('#event-head .facts-line');
    result.dots = dots('#event-series').length;
    location.hash = 'view=event&event=2';
    await moment();
    result.none = texts('#event-series');
  )");
  expect_probed(body);
  EXPECT_THAT(body, HasSubstr("data-groups=\"Lost: ok before, not any more (1)|Suspects (2)|"));
  EXPECT_THAT(body, has("first", "✕lostsince before these nightsunknown..unknown"));
  EXPECT_THAT(body, has("copies", "git log v1.2..v1.3"));
  EXPECT_THAT(body, HasSubstr("changed before these nights"));
  EXPECT_THAT(body, has("dots", 40));
  EXPECT_THAT(body, has("none", "None of its series is on this page."));
}

}  // namespace
}  // namespace reliefbench
