#include "kernels/base/suggest.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <numeric>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

constexpr std::size_t kLongestSlip = 64;  // bytes: what is longer is no slip, and would take long to compare

/// Levenshtein distance.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row[b.size()];
}

}  // namespace

std::string unknown_text(std::string_view word, const std::vector<std::string_view>& known) {
  const auto distance = [word](std::string_view other) { return edit_distance(word, other); };
  const bool may_be_slip = word.size() <= kLongestSlip;
  const auto nearest = may_be_slip ? std::ranges::min_element(known, {}, distance) : known.end();
  // A third of the word wrong (two swapped letters of four count as two) is still a slip; more is another word.
  const bool is_slip = nearest != known.end() && distance(*nearest) <= (word.size() + 2) / 3;
  return fmt::format("unknown ({}known: {})", is_slip ? fmt::format("did you mean '{}'?; ", *nearest) : "",
                     fmt::join(known, ", "));
}

void fail_unknown(std::string_view what, std::string_view id, const std::vector<std::string_view>& known) {
  fail_input("{} '{}' is {}", what, id, unknown_text(id, known));
}

}  // namespace reliefbench
