#pragma once
#include <span>
#include <string>
#include <string_view>

#include "kernels/trace/technique.h"

namespace reliefbench {

/// A setting as people read it: "cone cone_steps=64 format=rg8", the technique and what differs from its defaults.
[[nodiscard]] std::string short_name(const Settings& settings);

/// Eight hexadecimal digits that stand for a setting wherever a case's id does: the beginning of its id's SHA-256.
[[nodiscard]] std::string setting_key(const Settings& settings);
[[nodiscard]] bool is_setting_key(std::string_view text);

/// "cone cone_steps=64 format=rg8 [4cc2dca1]"
[[nodiscard]] std::string named(const Settings& settings);

/// The setting that a key stands for, among those that are known; null: none of them.
[[nodiscard]] const Settings* find_by_key(std::string_view key, std::span<const Settings> known);

}  // namespace reliefbench
