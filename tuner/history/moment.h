#pragma once
#include <cstdint>
#include <string>
#include <string_view>

namespace reliefbench {

/// Seconds since 1970 of ISO 8601 with a time: "2026-11-22T12:00:00Z", "2026-11-22T14:00+02:00", or of "@1795348800".
/// what: for messages, what the text is of. throws: Error(bad_input)
[[nodiscard]] std::int64_t parse_moment(std::string_view text, std::string_view what);

/// Seconds since 1970 as a history's rows have them: now, and for people ("2026-11-22T12:00:00Z").
[[nodiscard]] std::int64_t moment_now();
[[nodiscard]] std::string moment_text(std::int64_t unix_s);

}  // namespace reliefbench
