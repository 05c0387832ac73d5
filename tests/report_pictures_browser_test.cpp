// The pictures of a report in a browser: how they are compared, and what a screen shows of the page.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "kernels/image/image.h"
#include "kernels/judge/heat_map.h"
#include "tests/report_probe.h"
#include "tests/synthetic_run.h"
#include "tuner/decide/recommend.h"
#include "tuner/results/run_files.h"

namespace reliefbench {
namespace {

using testing::HasSubstr;

using ReportInBrowser = InBrowser;

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
    const press = (key, target = byId('stage')) => target.dispatchEvent(new KeyboardEvent('keydown', {key, bubbles: true}));
    const point = () => { const box = byId('stage').querySelector('.pane-picture').getBoundingClientRect();
      byId('stage').querySelector('.pane-picture').dispatchEvent(new PointerEvent('pointermove', {bubbles: true,
        clientX: box.left + box.width * 0.25, clientY: box.top + box.height * 0.75})); return byId('pixel').textContent; };
    result.strip = [...document.querySelectorAll('.strip-card .note')].map((n) => n.textContent).join();
    press('a', document.body);  // keys are the pictures' own
    result.mode = choice.mode;
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
  EXPECT_THAT(body, has("mode", "split"));
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

// To be looked at, where pictures are taken: build/screenshots/report_*.png.
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
      if (!leaves_pictures()) continue;
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
