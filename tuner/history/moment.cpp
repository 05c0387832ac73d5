#include "tuner/history/moment.h"

#include <charconv>
#include <chrono>
#include <optional>
#include <regex>
#include <string>

#include "kernels/base/clock.h"
#include "kernels/base/error.h"

namespace reliefbench {
namespace {

std::optional<std::int64_t> unix_seconds(std::string_view text) {
  std::int64_t seconds = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), seconds);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return seconds;
}

std::optional<std::int64_t> iso_seconds(const std::string& text) {
  static const std::regex pattern(
      R"((\d{4})-(\d{2})-(\d{2})T(\d{2}):(\d{2})(?::(\d{2})(?:\.\d+)?)?(?:Z|([+-])(\d{2}):?(\d{2})))");
  std::smatch parts;
  if (text.size() > 40 || !std::regex_match(text, parts, pattern)) return std::nullopt;
  const auto part = [&](std::size_t i) { return parts[i].matched ? std::stoi(parts[i].str()) : 0; };
  const auto day =
      std::chrono::year_month_day(std::chrono::year(part(1)), std::chrono::month(static_cast<unsigned>(part(2))),
                                  std::chrono::day(static_cast<unsigned>(part(3))));
  if (!day.ok() || part(4) > 23 || part(5) > 59 || part(6) > 60) return std::nullopt;
  const int offset_s = (part(8) * 60 + part(9)) * (parts[7] == "-" ? -60 : 60);
  const std::chrono::seconds days = std::chrono::sys_days(day).time_since_epoch();
  const int of_day_s = part(4) * 3600 + part(5) * 60 + part(6);
  return days.count() + of_day_s - offset_s;
}

}  // namespace

std::int64_t parse_moment(std::string_view text, std::string_view what) {
  const auto seconds = text.starts_with('@') ? unix_seconds(text.substr(1)) : iso_seconds(std::string(text));
  if (!seconds) fail_input("{} '{}': expected a time as 2026-11-22T12:00:00Z or @1795348800", what, text);
  return *seconds;
}

std::int64_t moment_now() { return static_cast<std::int64_t>(unix_ns() / 1e9); }

std::string moment_text(std::int64_t unix_s) { return utc_text(1e9 * static_cast<double>(unix_s)); }

}  // namespace reliefbench
