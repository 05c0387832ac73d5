#pragma once
#include <span>
#include <string_view>
#include <vector>

namespace reliefbench {

/// What the sources cite as [id].
struct Paper {
  std::string_view id;
  std::string_view authors;  ///< empty: a book chapter known by its title
  std::string_view title;
  std::string_view where;  ///< and when
};
[[nodiscard]] std::span<const Paper> papers();

/// Those that a text names as [id].
[[nodiscard]] std::vector<Paper> papers_cited_by(std::string_view text);

}  // namespace reliefbench
