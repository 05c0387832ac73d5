#include "kernels/trace/param.h"

#include <algorithm>
#include <charconv>

#include "kernels/base/error.h"

namespace reliefbench {

std::string Param::text(int value) const {
  return choices.empty() ? fmt::format("{}", value) : std::string(choices.at(static_cast<std::size_t>(value)));
}

int Param::parse(std::string_view text) const {
  if (choices.empty()) {
    int value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size()) fail_input("{}='{}' is not an integer", id, text);
    check(value);
    return value;
  }
  const auto found = std::ranges::find(choices, text);
  if (found == choices.end()) fail_input("{}='{}' is unknown (expected one of {})", id, text, fmt::join(choices, ", "));
  return static_cast<int>(found - choices.begin());
}

void Param::check(int value) const {
  if (value < min || value > max) fail_input("{}={} is out of range (expected {} to {})", id, value, min, max);
}

Param range_param(std::string_view id, std::string_view description, int min, int max, int fallback) {
  return {.id = id, .description = description, .min = min, .max = max, .fallback = fallback};
}

Param choice_param(std::string_view id, std::string_view description, std::vector<std::string_view> choices,
                   std::string_view fallback) {
  const auto found = std::ranges::find(choices, fallback);
  const int last = static_cast<int>(choices.size()) - 1;
  const int fallback_index = static_cast<int>(found - choices.begin());
  return {.id = id, .description = description, .max = last, .fallback = fallback_index, .choices = std::move(choices)};
}

}  // namespace reliefbench
