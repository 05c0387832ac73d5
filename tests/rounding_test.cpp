#include "kernels/base/rounding.h"

#include <gtest/gtest.h>

#include <clocale>
#include <limits>
#include <string>

namespace reliefbench {
namespace {

using Limits = std::numeric_limits<double>;

TEST(Rounding, to_digits_is_of_every_size) {
  EXPECT_EQ(rounded_to_digits(123456.5, 5), 123460);
  EXPECT_EQ(rounded_to_digits(-0.000123449, 4), -0.0001234);
  EXPECT_EQ(rounded_to_digits(0.1, 17), 0.1);
  EXPECT_EQ(rounded_to_digits(0, 6), 0);
  EXPECT_EQ(rounded_to_digits(1.23456789e-310, 5), 1.2346e-310) << "a subnormal";
  EXPECT_EQ(rounded_to_digits(Limits::denorm_min(), 5), Limits::denorm_min());
  EXPECT_EQ(rounded_to_digits(Limits::max(), 5), Limits::max()) << "1.7977e308 is over all doubles";
  EXPECT_EQ(rounded_to_digits(Limits::infinity(), 5), Limits::infinity());
}

TEST(Rounding, to_digits_heeds_no_locale) {
  const std::string before = std::setlocale(LC_NUMERIC, nullptr);
  const char* comma = nullptr;
  for (const char* locale : {"de_DE.UTF-8", "fr_FR.UTF-8", "nl_NL.UTF-8", "ru_RU.UTF-8"})
    if (comma == nullptr) comma = std::setlocale(LC_NUMERIC, locale);
  const double rounded = rounded_to_digits(1.2345678, 5);
  std::setlocale(LC_NUMERIC, before.c_str());
  EXPECT_EQ(rounded, 1.2346);
  if (comma == nullptr) GTEST_SKIP() << "no locale with a decimal comma is installed";
}

}  // namespace
}  // namespace reliefbench
