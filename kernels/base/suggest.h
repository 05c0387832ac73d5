#pragma once
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

namespace reliefbench {

/// "unknown (did you mean 'b'?; known: a, b)"
[[nodiscard]] std::string unknown_text(std::string_view word, const std::vector<std::string_view>& known);

/// what: "technique". throws: Error(bad_input): "technique 'konus' is unknown (did you mean 'cone'?; known: ...)"
[[noreturn]] void fail_unknown(std::string_view what, std::string_view id, const std::vector<std::string_view>& known);

/// The ids of a registry's rows.
template <typename Rows>
[[nodiscard]] std::vector<std::string_view> ids_of(const Rows& rows) {
  std::vector<std::string_view> ids;
  ids.reserve(std::size(rows));
  for (const auto& row : rows) ids.push_back(row.id);
  return ids;
}

/// The row of a registry that has this id. throws: as fail_unknown()
template <typename Rows>
[[nodiscard]] const auto& find_row(const Rows& rows, std::string_view what, std::string_view id) {
  for (const auto& row : rows)
    if (row.id == id) return row;
  fail_unknown(what, id, ids_of(rows));
}

}  // namespace reliefbench
