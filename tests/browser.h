#pragma once
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "tests/command.h"
#include "tests/temp_folder.h"

namespace reliefbench {

/// How a page is opened.
struct Opening {
  std::string fragment{};  ///< of the URL, without '#'
  int width_px = 1280;
  int height_px = 900;
  bool is_dark = false;
  bool in_real_time = false;  ///< for figures of time; nothing is waited for then
  bool with_webgpu = false;   ///< on SwiftShader, which is the browser's own; in real time, too: see kHold
};

/// A script's lines that keep a page from being loaded, and so from being read, until it calls hold.close().
inline constexpr const char* kHold =
    "const hold = (() => { const frame = document.createElement('iframe'); document.body.append(frame); "
    "return frame.contentDocument; })(); hold.open();";

/// Opens pages in headless Chromium, as a reader does: from a file, without a network.
class InBrowser : public testing::Test {
 protected:
  void SetUp() override {
    if (output_of("command -v chromium").empty())
      GTEST_SKIP() << "chromium is not installed (apt-get install chromium)";
  }

  /// The document once its scripts have run, and nothing was written to the console. `probe` is a script that runs
  /// after the page's own; what it leaves in `result` are data attributes of the body.
  [[nodiscard]] std::string document(std::string html, const std::string& probe, const Opening& opening = {}) const {
    const bool is_framed = opening.width_px < kLeastWidth_px;
    const std::string script =
        "<script>addEventListener('load', () => { const result = document.body.dataset; result.resources = "
        "performance.getEntriesByType('resource').filter((e) => !e.name.startsWith('data:')).length;" +
        std::string(is_framed ? "setInterval(() => parent.postMessage({...result}, '*'), 500);" : "") + probe +
        "});</script>";
    const std::size_t end = html.rfind("</body>");
    if (end == std::string::npos) return "";
    html.insert(end, script);
    std::ofstream(folder_ / (is_framed ? "frame.html" : "page.html")) << html;
    if (is_framed)
      std::ofstream(folder_ / "page.html") << fmt::format(
          "<meta name='color-scheme' content='light dark'><body><iframe src='frame.html#{}' width={} "
          "height={}></iframe>"
          "\n<script>addEventListener('message', (e) => Object.assign(document.body.dataset, e.data));</script>",
          opening.fragment, opening.width_px, opening.height_px);
    const std::string dom = open_page("--dump-dom", opening);
    EXPECT_EQ(output_of(fmt::format("grep ':CONSOLE' '{}'", (folder_ / "log.txt").string())), "");
    return dom;
  }

  /// Leaves a picture of the page. In real time: a narrow page is laid out twice, and charts follow in the next frame.
  void screenshot(const std::string& html, const std::filesystem::path& picture, Opening opening) const {
    opening.in_real_time = true;
    std::ofstream(folder_ / "page.html") << html;
    (void)open_page(fmt::format("--hide-scrollbars --timeout=4000 --screenshot='{}'", picture.string()), opening);
  }

  TempFolder folder_;

 private:
  static constexpr int kLeastWidth_px = 500;  ///< of a window; a narrower page is looked at in a frame

  [[nodiscard]] std::string open_page(const std::string& purpose, const Opening& opening) const {
    return output_of(fmt::format(
        "timeout 120 chromium --headless --no-sandbox {7} --disable-quic --disable-dev-shm-usage "
        "--no-first-run --disable-background-networking --disable-component-update --disable-sync "
        "--enable-logging=stderr --user-data-dir='{0}/profile' --window-size={1},{2} "
        "--blink-settings=preferredColorScheme={3} {4} {5} 'file://{0}/page.html#{6}' 2>'{0}/log.txt'",
        folder_.path().string(), opening.width_px, opening.height_px, opening.is_dark ? 0 : 1,
        opening.in_real_time || opening.with_webgpu ? "" : "--virtual-time-budget=10000", purpose, opening.fragment,
        opening.with_webgpu ? "--enable-unsafe-webgpu --use-webgpu-adapter=swiftshader" : "--disable-gpu"));
  }
};

/// The start tag, whose data attributes tell what the scripts found.
inline std::string body_tag(const std::string& dom) {
  const std::size_t begin = dom.find("<body");
  return begin == std::string::npos ? "no page" : dom.substr(begin, dom.find("\n<script>", begin) - begin);
}

/// result.NAME of a probe, as it stands in the body's tag.
inline auto has(const std::string& name, const std::string& value) {
  return testing::HasSubstr(fmt::format("data-{}=\"{}\"", name, value));
}
inline auto has(const std::string& name, std::size_t value) { return has(name, std::to_string(value)); }

/// A page that was drawn to its end, without an error and with nothing loaded.
inline void expect_drawn(const std::string& body) {
  EXPECT_THAT(body, testing::HasSubstr("data-rendered=\"true\""));
  EXPECT_THAT(body, testing::HasSubstr("data-resources=\"0\""));
  EXPECT_THAT(body, testing::Not(testing::HasSubstr("data-errors=")));
}

}  // namespace reliefbench
