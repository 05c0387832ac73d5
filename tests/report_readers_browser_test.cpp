// A report of several devices, with gaps in its figures, as readers go about in it: with the keyboard, by links.
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "tests/report_probe.h"
#include "tests/synthetic_run.h"

namespace reliefbench {
namespace {

using testing::HasSubstr;
using testing::Not;

class ReportOfDevices : public InBrowser {
 protected:
  /// The settings of both are the same; at a place in the order of the second only, one errs less.
  [[nodiscard]] static std::vector<reliefbench::Run> two_devices() {
    std::vector<reliefbench::Run> runs = {
        synthetic_run({.folder = "a", .device = "Slow GPU", .backends = {"vulkan"}, .cases = 30, .slowness = 4}),
        synthetic_run({.folder = "b", .device = "Fast GPU", .backends = {"vulkan"}, .cases = 30})};
    return runs;
  }
};

TEST_F(ReportOfDevices, EachHasItsOwnAnswers) {
  const std::string body = body_tag(document(make_report(two_devices()), R"(
    choose({time_ms: 2});
    // Every part of every device's answer stands with the device's price, with its own time; where several devices have
    // one pick, with its name.
    const parts = {'Within time': 'accurate', Tie: 'tie', 'Just fails': 'justFails', 'Flat floor': 'flat'};
    const cards = [...document.querySelectorAll('#answer-cards .card')];
    const untold = [];
    let differing = 0;
    data.scenes.forEach((_, scene) => {
      const answers = groupsOf(scene).map((group) => answerOf(scene, group));
      for (const [label, part] of Object.entries(parts)) {
        differing += new Set(answers.map((a) => data.points[a[part]]?.setting)).size > 1;
        for (const answer of answers.filter(({pick}) => pick !== null)) {
          const block = [...cards[scene].querySelectorAll('.answer')].find((one) =>
              [...one.querySelectorAll('.price')].some((p) => p.textContent.includes(shortLabel(answer.group))));
          const rows = [...block.querySelectorAll('.answer-row')].map((row) => row.textContent);
          const name = block.querySelectorAll('.price').length > 1 ? briefLabel(answer.group) : '';
          const point = data.points[answer[part]];
          if (!point && label !== 'Within time') continue;
          const words = point ? [settingOf(point).key, `${formatTime(point.time_ns[0])} `] : ['nothing is so fast'];
          if (!rows.some((row) => [label, name, ...words].every((word) => row.includes(word))))
            untold.push(`${scene} ${label} ${shortLabel(answer.group)} ${words}`);
        }
      }
    });
    result.differing = differing > 0;
    result.untold = untold.join('; ') || 'none';
    result.count = byId('plot-count').textContent;
    result.spoken = byId('plot').getAttribute('aria-label');
    result.table = document.querySelector('#table summary').textContent;
    result.expected = plotted.fronts.map(({group, indices}) => `${briefLabel(group)} ${indices.length}`).join(', ');
    result.legend = [...document.querySelectorAll('#mark-legend .mark')].map((mark) => mark.textContent).join('|');
    const lines = plotted.chart.data.datasets.filter(({type}) => type === 'line');
    result.dashes = new Set(lines.map(({borderDash}) => String(borderDash))).size;
    choose({group: 0});
    result.one = byId('plot-count').textContent;
  )"));
  expect_drawn(body);
  EXPECT_THAT(body, has("differing", "true"));
  EXPECT_THAT(body, has("untold", "none"));
  EXPECT_THAT(body, testing::ContainsRegex("data-count=\"30 settings on 2 devices; on the fronts: Slow GPU [0-9]+, "
                                           "Fast GPU [0-9]+\""));
  EXPECT_THAT(body, HasSubstr("rocks/oblique: 30 settings on 2 devices; on the fronts: Slow GPU"));
  EXPECT_THAT(body, has("table", "The 30 settings on 2 devices as a table"));
  EXPECT_THAT(body, HasSubstr("|front, Slow GPU|front, Fast GPU|dominated"));
  EXPECT_THAT(body, has("dashes", 2));
  EXPECT_THAT(body, testing::ContainsRegex("data-one=\"30 settings, [0-9]+ on the front\""));
}

// A merged run's argv is that of `merge`: what measures a case again is told by what the case was measured with.
TEST_F(ReportOfDevices, TheCommandOfAMergedRunsPointMeasuresTheSame) {
  reliefbench::Run run = synthetic_run({.backends = {"vulkan"}, .scenes = {"rocks/oblique"}, .cases = 3});
  run.info["argv"] = {"reliefbench", "merge", "a", "b", "-o", "m"};
  run.info["parts"] = {{{"folder", "a"}}, {{"folder", "b"}}};
  run.info["identity"]["devices"] = {{{"backend", "opengl"}, {"name", "Synthetic GPU"}, {"index", 2}},
                                     {{"backend", "vulkan"}, {"name", "Synthetic GPU"}, {"index", 1}}};
  run.info["identity"]["injected_slowdown"] = {{"relief", 1.5}};
  const std::string body = body_tag(document(report_of(run), R"(
    choose({pins: [0]});
    result.command = document.querySelector('#pins .command-line code').textContent;
    result.pictures = document.querySelector('#stage').textContent;
    result.commands = document.querySelectorAll('#stage code').length;
  )"));
  expect_drawn(body);
  const Scene scene = synthetic_scene("rocks/oblique").spec.scene;
  EXPECT_THAT(body, HasSubstr(fmt::format("--backend vulkan --frame-px {}x{} --device 1 --inject-slowdown relief:1.5\"",
                                          scene.width_px, scene.height_px)));
  EXPECT_THAT(body, HasSubstr("which was merged: sweep its parts (a, b) to their ends with pictures"));
  EXPECT_THAT(body, has("commands", 0));
}

TEST_F(ReportOfDevices, WhatHasNoValueIsNoneOfTheBest) {
  reliefbench::Run run = synthetic_run({.backends = {"vulkan"}, .scenes = {"rocks/oblique"}, .cases = 20});
  int without = 0;
  for (Record& record : run.records)
    if (record.error && record.case_id.size() % 2 == 0) {
      (*record.error)["flip"] = std::nullopt;
      ++without;
    }
  ASSERT_GT(without, 0);
  ASSERT_LT(without, 20);
  const std::string body = body_tag(document(report_of(run), R"(
    choose({metric: metricIndex.get('flip')});
    byId('table').open = true;
    drawTable();
    const sort = () => [...document.querySelectorAll('#table-rows th button')].find((b) => b.textContent === 'flip').click();
    const ends = () => tableOrder().map((index) => (data.points[index].errors[choice.metric] === null ? 'none' : 'some')).join(' ');
    sort();
    const rising = ends();
    sort();
    result.last = String(/^(some )+(none ?)+$/.test(rising) && rising === ends());
    result.drawn = plotted.chart.data.datasets.filter(({type}) => type === 'scatter').reduce((sum, {data}) => sum + data.length, 0);
    result.count = byId('plot-count').textContent;
    result.reachable = plotted.drawn.length;
    result.head = csvText().split('\r\n')[0];
  )"));
  expect_drawn(body);
  EXPECT_THAT(body, has("last", "true"));
  EXPECT_THAT(body, has("drawn", static_cast<std::size_t>(20 - without)));
  EXPECT_THAT(body, has("reachable", static_cast<std::size_t>(20 - without)));
  EXPECT_THAT(body, HasSubstr(fmt::format("; not drawn, as they have no flip: {}\"", without)));
  // As table.csv calls them.
  EXPECT_THAT(body, HasSubstr("data-head=\"case,technique,backend,device,scene,key,"));
  EXPECT_THAT(
      body,
      HasSubstr(",memory_bytes,bake_time_ns,device_bake_ns,first_draw_ns,median_ns,ci_low_ns,ci_high_ns,samples\""));
}

TEST_F(ReportOfDevices, TheKeyboardKeepsItsPlace) {
  const std::string body = body_tag(document(make_report(two_devices()), R"(
    const lost = [];
    /** act: what redraws the control that has the focus */
    const keeps = (name, control, act) => {
      control.focus();
      const key = keyOf(control);
      act(control);
      if (document.activeElement === document.body || keyOf(document.activeElement) !== key) lost.push(name);
      if (control.isConnected) lost.push(`${name} was not redrawn`);
    };
    const click = (control) => control.click();
    const last = (control) => { control.selectedIndex = control.options.length - 1; control.dispatchEvent(new Event('change')); };
    const first = (selector) => document.querySelector(selector);
    keeps('scene', document.querySelectorAll('#scenes button')[1], click);
    keeps('technique', first('#technique-legend button'), click);
    keeps('device', first('select[name=group]'), last);
    keeps('metric', byId('metric'), last);
    byId('table').open = true;
    drawTable();
    keeps('column', document.querySelectorAll('#table-rows th button')[2], click);
    choose({pins: [0, 1]});
    // What is gone has a successor.
    const close = first('#pins .close');
    close.focus();
    close.click();
    result.successor = String(document.activeElement.matches('#pins button'));
    result.lost = lost.join() || 'none';
    const before = location.hash;
    first('nav a[href="#effects"]').click();
    result.kept = String(before.length > 2 && location.hash === before && document.activeElement.id === 'effects');
    const name = first('#answer-cards .settings');
    getSelection().selectAllChildren(name);
    result.copied = String(String(getSelection()).trim() === name.textContent && /^[a-z_]+( [a-z_]+=\S+)* \[[0-9a-f]{8}\]( \*)?$/.test(name.textContent));
    byId('strip').hidden = true;
    result.gone = getComputedStyle(byId('strip')).display;
  )"));
  expect_drawn(body);
  EXPECT_THAT(body, has("lost", "none"));
  EXPECT_THAT(body, has("successor", "true"));
  EXPECT_THAT(body, has("kept", "true"));
  EXPECT_THAT(body, has("copied", "true"));
  EXPECT_THAT(body, has("gone", "none"));
}

// A report of the same that has its scenes, settings and devices in another order.
TEST_F(ReportOfDevices, ALinkNamesThings) {
  const reliefbench::Run run = synthetic_run({.cases = 12});
  const std::string told_of = R"(
    const point = data.points[choice.pins[0]];
    result.state = [sceneName(choice.scene), data.groups[choice.group].backend, sceneName(point.scene),
                    data.groups[point.group].backend, settingOf(point).name, choice.pins.length].join(' ');
    result.missing = byId('link-missing').hidden ? 'none' : byId('link-missing').textContent;
  )";
  const std::string made = body_tag(document(report_of(run), R"(
    const at = data.points.findIndex((p) => p.scene === 1 && data.groups[p.group].backend === 'vulkan' && paramOf(p, 'format') === 'rg16');
    choose({scene: 1, group: 1, pins: [at]});
    result.fragment = location.hash.slice(1).replaceAll('&', ' ');
  )" + told_of));
  expect_drawn(made);
  EXPECT_THAT(made, testing::ContainsRegex("data-fragment=\"scene=rocks/grazing group=vulkan "
                                           "pins=rocks/grazing:vulkan:[0-9a-f]{8}\""));
  EXPECT_THAT(made, HasSubstr("data-state=\"rocks/grazing vulkan rocks/grazing vulkan "));
  EXPECT_THAT(made, has("missing", "none"));
  std::smatch fragment;
  ASSERT_TRUE(std::regex_search(made, fragment, std::regex("data-fragment=\"([^\"]*)\"")));
  std::string link = fragment[1];
  std::ranges::replace(link, ' ', '&');

  reliefbench::Run other = run;
  std::ranges::reverse(other.records);
  const std::string again = body_tag(document(report_of(other), told_of, {.fragment = link}));
  expect_drawn(again);
  std::smatch state;
  ASSERT_TRUE(std::regex_search(made, state, std::regex("data-state=\"[^\"]*\"")));
  EXPECT_THAT(again, HasSubstr(state.str()));
  EXPECT_THAT(again, has("missing", "none"));

  std::erase_if(other.records, [](const Record& record) { return record.scene == "rocks/grazing"; });
  const std::string gone = body_tag(document(report_of(other),
                                             "result.said = byId('link-missing').textContent;"
                                             "result.pins = choice.pins.length;",
                                             {.fragment = link}));
  expect_drawn(gone);
  EXPECT_THAT(gone, HasSubstr("data-said=\"Not in this report, though the link names it: rocks/grazing, "
                              "rocks/grazing:vulkan:"));
  EXPECT_THAT(gone, has("pins", 0));
}

TEST_F(ReportOfDevices, ThatNothingWasMeasuredIsSaidFirst) {
  reliefbench::Run run = synthetic_run({.backends = {"null"}, .scenes = {"flat/top"}, .cases = 1});
  std::erase_if(run.records, [](const Record& record) { return record.status == Status::ok; });
  const std::string body = body_tag(document(report_of(run), R"(
    result.first = document.querySelector('#notices .notice').firstElementChild.textContent;
    setTimeout(() => result.why = document.querySelectorAll('#environment-runs tbody tr').length, 0);
  )"));
  expect_drawn(body);
  EXPECT_THAT(body, has("first", "Nothing was measured: no case ended well. The reasons are below."));
  EXPECT_THAT(body, Not(has("why", 0)));
}

}  // namespace
}  // namespace reliefbench
