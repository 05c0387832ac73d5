#include "kernels/base/json_lines.h"

#include <gtest/gtest.h>

#include <ctime>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

std::string object_of_keys(int count, const std::string& last) {
  std::string text = "{\n";
  for (int i = 0; i < count; ++i) text += fmt::format("\"key{}\": {},\n", i, i);
  return text + "\"" + last + "\": 0}";
}

double cpu_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

// Twice the keys take about twice the time. A search of all earlier keys would take four times.
TEST(JsonLines, ManyKeysTakeTimeInProportion) {
  constexpr int kKeys = 60'000;
  const double start_s = cpu_s();
  EXPECT_EQ(parse_json_lines(object_of_keys(kKeys, "last"), "c.json").children.size(), kKeys + 1U);
  const double once_s = cpu_s() - start_s;
  EXPECT_EQ(parse_json_lines(object_of_keys(2 * kKeys, "last"), "c.json").children.size(), 2U * kKeys + 1);
  const double twice_s = cpu_s() - start_s - once_s;
  EXPECT_LT(twice_s, 3 * once_s);
}

TEST(JsonLines, AKeyThatStandsTwiceIsFoundAmongMany) {
  try {
    (void)parse_json_lines(object_of_keys(5000, "key7"), "c.json");
    FAIL() << "no error was thrown";
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "c.json:5002: key 'key7': stands twice, first in line 9");
  }
  // The same key in another object is another key.
  EXPECT_EQ(parse_json_lines(R"({"a": {"b": 1}, "c": [{"b": 1}, {"b": 2}], "b": 3})", "c.json").children.size(), 3U);
}

}  // namespace
}  // namespace reliefbench
