// How quick the trend page of a large history is, and pictures of the page for people to look at.
#include <iostream>
#include <nlohmann/json.hpp>

#include "reports/pages/trend_page.h"
#include "tests/browser.h"
#include "tests/made_trend.h"

namespace reliefbench {
namespace {

using testing::HasSubstr;

using LargeTrendInBrowser = InBrowser;

// A reader of a large history waits for neither the first look nor a filter. With the browser's clock, which stands
// still while a page is dumped in virtual time: nothing is awaited here.
TEST_F(LargeTrendInBrowser, AThousandSeriesOfFourHundredNightsAreQuick) {
  const std::string probe = R"(
    const timed = (action) => {
      const start = performance.now();
      action();
      document.body.getBoundingClientRect();  // with the layout
      return Math.round(performance.now() - start);
    };
    result.elements = document.querySelectorAll('*').length;
    result.painted = Math.round(performance.getEntriesByType('paint').map(({startTime}) => startTime).concat(0)[0]);
    document.body.getBoundingClientRect();
    result.drawn = Math.round(performance.now());
    result.opened = timed(() => { location.hash = 'view=series'; readState(); showView(); });
    const choose = (selector, value, event) => timed(() => {
      const control = document.querySelector(selector);
      control.value = value;
      control.dispatchEvent(new Event(event));
    });
    const filters = ['cone', 'qdm', '', 'relief'].map((value) => choose('#filters select[name=technique]', value, 'change'));
    const searches = ['g', 'gr', 'gra', 'grazing'].map((value) => choose('#filters input', value, 'input'));
    const took = [...filters, ...searches].sort((a, b) => a - b);
    result.filtered = took[4];
    result.slowest = took[7];
    result.found = byId('series-count').textContent;
    result.elementsafter = document.querySelectorAll('*').length;
  )";
  const std::string body =
      body_tag(document(trend_page(made_trend({.series = 1000, .nights = 400})), probe, {.in_real_time = true}));
  expect_drawn(body);
  const auto figure = [&](const std::string& name) {
    const std::size_t at = body.find("data-" + name + "=\"");
    return at == std::string::npos ? 1e9 : std::stod(body.substr(at + name.size() + 7));
  };
  std::cout << fmt::format(
      "first paint {} ms, drawn {} ms, series opened {} ms, a filter {} ms, the slowest {} ms; {} and {} elements\n",
      figure("painted"), figure("drawn"), figure("opened"), figure("filtered"), figure("slowest"), figure("elements"),
      figure("elementsafter"));
  for (const char* timed : {"painted", "drawn", "opened", "filtered", "slowest"})
    EXPECT_LT(figure(timed), 1e9) << timed;  // times are printed: a busy machine has others
  EXPECT_LT(figure("elementsafter"), 2000);
  EXPECT_THAT(body, HasSubstr(" of 1000 series"));
}

using TrendPictures = InBrowser;

// To be looked at, where pictures are taken: build/screenshots/trend_*.png.
TEST_F(TrendPictures, AreLeftInTheBuildFolder) {
  if (!leaves_pictures()) GTEST_SKIP() << "RELIEFBENCH_PICTURES is not set";
  const std::filesystem::path folder = std::filesystem::path(RELIEFBENCH_SOURCE_DIR) / "build" / "screenshots";
  std::filesystem::create_directories(folder);
  const std::string html = trend_page(made_trend());
  const auto take = [&](const std::string& name, const Opening& opening) {
    const std::filesystem::path picture =
        folder / fmt::format("trend_{}_{}{}.png", opening.width_px, opening.is_dark ? "dark" : "light", name);
    std::filesystem::remove(picture);
    screenshot(html, picture, opening);
    EXPECT_TRUE(std::filesystem::exists(picture) && std::filesystem::file_size(picture) > 20000) << picture;
  };
  for (const bool is_dark : {false, true}) {
    take("", {.height_px = 1560, .is_dark = is_dark});
    take("", {.width_px = 390, .height_px = 2620, .is_dark = is_dark});
    take("_event", {.fragment = "view=event&event=1", .height_px = 2000, .is_dark = is_dark});
    take("_event", {.fragment = "view=event&event=1", .width_px = 390, .height_px = 2600, .is_dark = is_dark});
  }
  take("_series", {.fragment = "view=series", .height_px = 1250});
  take("_machines", {.fragment = "view=machines", .height_px = 1900});
}

}  // namespace
}  // namespace reliefbench
