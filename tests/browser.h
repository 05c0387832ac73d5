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

/// Opens pages in headless Chromium, as a reader does: from a file, without a network.
class InBrowser : public testing::Test {
 protected:
  void SetUp() override {
    if (output_of("command -v chromium").empty())
      GTEST_SKIP() << "chromium is not installed (apt-get install chromium)";
  }

  /// The document once its scripts have run, and nothing was written to the console. `probe` is a script that runs
  /// after the page's own; what it leaves in `result` are data attributes of the body.
  [[nodiscard]] std::string document(std::string html, const std::string& probe) const {
    const std::string script =
        "<script>addEventListener('load', () => { const result = document.body.dataset; result.resources = "
        "performance.getEntriesByType('resource').filter((e) => !e.name.startsWith('data:')).length;" +
        probe + "});</script>";
    const std::size_t end = html.rfind("</body>");
    if (end == std::string::npos) return "";
    html.insert(end, script);
    std::ofstream(folder_ / "page.html") << html;
    const std::string dom = output_of(
        fmt::format("timeout 120 chromium --headless --no-sandbox --disable-gpu --disable-quic --disable-dev-shm-usage "
                    "--no-first-run --disable-background-networking --disable-component-update --disable-sync "
                    "--enable-logging=stderr --user-data-dir='{0}/profile' --virtual-time-budget=10000 --dump-dom "
                    "'file://{0}/page.html' 2>'{0}/log.txt'",
                    folder_.path().string()));
    EXPECT_EQ(output_of(fmt::format("grep ':CONSOLE' '{}'", (folder_ / "log.txt").string())), "");
    return dom;
  }

  TempFolder folder_;
};

/// The start tag, whose data attributes tell what the scripts found.
inline std::string body_tag(const std::string& dom) {
  const std::size_t begin = dom.find("<body");
  return begin == std::string::npos ? "no page" : dom.substr(begin, dom.find("\n<script>", begin) - begin);
}

/// A page that was drawn to its end, without an error and with nothing loaded.
inline void expect_drawn(const std::string& body) {
  EXPECT_THAT(body, testing::HasSubstr("data-rendered=\"true\""));
  EXPECT_THAT(body, testing::HasSubstr("data-resources=\"0\""));
  EXPECT_THAT(body, testing::Not(testing::HasSubstr("data-errors=")));
}

}  // namespace reliefbench
