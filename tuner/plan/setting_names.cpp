#include "tuner/plan/setting_names.h"

#include <fmt/format.h>

#include <algorithm>

#include "kernels/base/sha256.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

constexpr std::size_t kKeyDigits = 8;

}  // namespace

std::string short_name(const Settings& settings) {
  std::string text(settings.technique().id);
  for (const SettingValue& given : settings.values())
    if (given.value != given.param.fallback) text += fmt::format(" {}={}", given.param.id, given.text());
  return text;
}

std::string setting_key(const Settings& settings) { return sha256(setting_id(settings)).substr(0, kKeyDigits); }

bool is_setting_key(std::string_view text) {
  const auto is_digit = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); };
  return text.size() == kKeyDigits && std::ranges::all_of(text, is_digit);
}

std::string named(const Settings& settings) {
  return fmt::format("{} [{}]", short_name(settings), setting_key(settings));
}

const Settings* find_by_key(std::string_view key, std::span<const Settings> known) {
  const auto found = std::ranges::find(known, key, setting_key);
  return found == known.end() ? nullptr : &*found;
}

}  // namespace reliefbench
