#pragma once
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/chromium.h"
#include "tests/temp_folder.h"

namespace reliefbench {

/// A script's lines that keep a page from being loaded, and so from being read, until it calls hold.close().
inline constexpr const char* kHold =
    "const hold = (() => { const frame = document.createElement('iframe'); document.body.append(frame); "
    "return frame.contentDocument; })(); hold.open();";

/// Whether pictures for people are taken, into build/screenshots: RELIEFBENCH_PICTURES=1 ./dev test
inline bool leaves_pictures() { return std::getenv("RELIEFBENCH_PICTURES") != nullptr; }

/// Opens pages in headless Chromium, as a reader does: from a file, without a network.
class InBrowser : public testing::Test {
 protected:
  void SetUp() override {
    if (!Chromium::is_installed()) GTEST_SKIP() << "chromium is not installed (apt-get install chromium)";
  }

  /// The document once its scripts have run, and nothing was written to the console. `probe` is a script that runs
  /// after the page's own; what it leaves in `result` are data attributes of the body.
  [[nodiscard]] std::string document(std::string html, const std::string& probe, const Opening& opening = {}) const {
    const std::string script =
        "<script>addEventListener('load', () => { const result = document.body.dataset; result.resources = "
        "performance.getEntriesByType('resource').filter((e) => !e.name.startsWith('data:')).length;" +
        probe + "});</script>";
    const std::size_t end = html.rfind("</body>");
    if (end == std::string::npos) return "";
    html.insert(end, script);
    const Chromium::Page page = open(html, opening, false);
    EXPECT_THAT(page.complaints, testing::IsEmpty());
    return page.dom;
  }

  /// Leaves a picture of the page.
  void screenshot(const std::string& html, const std::filesystem::path& picture, const Opening& opening) const {
    std::ofstream(picture, std::ios::binary) << open(html, opening, true).png;
  }

  TempFolder folder_;

 private:
  [[nodiscard]] Chromium::Page open(const std::string& html, const Opening& opening, bool picture) const {
    std::ofstream(folder_ / "page.html") << html;
    return Chromium::shared(opening.with_webgpu).open(folder_ / "page.html", opening, picture);
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
