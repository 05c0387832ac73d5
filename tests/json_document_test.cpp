#include "kernels/base/json_document.h"

#include <gtest/gtest.h>

#include <ctime>
#include <fstream>

#include "kernels/base/error.h"
#include "kernels/base/json_file.h"
#include "kernels/base/suggest.h"
#include "tests/temp_folder.h"

namespace reliefbench {
namespace {

std::string object_of_keys(int count, const std::string& last) {
  std::string text = "{\n";
  for (int i = 0; i < count; ++i) text += fmt::format("\"key{}\": {},\n", i, i);
  return text + "\"" + last + "\": 0}";
}

double cpu_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

// Twice the keys take about twice the time. A search of all earlier keys would take four times.
TEST(JsonDocument, ManyKeysTakeTimeInProportion) {
  constexpr int kKeys = 60'000;
  const double start_s = cpu_s();
  EXPECT_EQ(parse_json_document(object_of_keys(kKeys, "last"), "c.json").children.size(), kKeys + 1U);
  const double once_s = cpu_s() - start_s;
  EXPECT_EQ(parse_json_document(object_of_keys(2 * kKeys, "last"), "c.json").children.size(), 2U * kKeys + 1);
  const double twice_s = cpu_s() - start_s - once_s;
  EXPECT_LT(twice_s, 3 * once_s);
}

TEST(JsonDocument, AKeyThatStandsTwiceIsFoundAmongMany) {
  try {
    (void)parse_json_document(object_of_keys(5000, "key7"), "c.json");
    FAIL() << "no error was thrown";
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "c.json:5002: key 'key7': stands twice, first in line 9");
  }
  // The same key in another object is another key.
  EXPECT_EQ(parse_json_document(R"({"a": {"b": 1}, "c": [{"b": 1}, {"b": 2}], "b": 3})", "c.json").children.size(), 3U);
}

TEST(JsonFile, WhatIsTornOrTooDeepIsRefusedByName) {
  const TempFolder folder;
  const auto refusal = [&](const std::string& text) {
    std::ofstream(folder / "a.json") << text;
    try {
      (void)read_json(folder / "a.json");
    } catch (const Error& error) {
      return std::string(error.what()).substr((folder / "a.json").string().size());
    }
    return std::string("read");
  };
  const auto nested = [](int depth) { return std::string(depth, '[') + "\"[[\\\"[[\"" + std::string(depth, ']'); };
  EXPECT_EQ(refusal(nested(64)), "read");
  EXPECT_EQ(refusal(nested(65)), ": over 64 levels deep");
  EXPECT_EQ(refusal(std::string(300'000, '[')), ": over 64 levels deep");
  EXPECT_EQ(refusal("{\"a\": 1"), ": torn, or not JSON");
  EXPECT_EQ(refusal("]]]]"), ": torn, or not JSON");
}

// A word of a megabyte is none of the known ones, and is compared with none of them.
TEST(Suggestion, OnlyAShortWordMayBeASlip) {
  const std::string known(60, 'x');
  EXPECT_NE(unknown_text(known + "y", {known}).find("did you mean"), std::string::npos);
  EXPECT_EQ(unknown_text(std::string(65, 'x'), {known}).find("did you mean"), std::string::npos);
}

}  // namespace
}  // namespace reliefbench
