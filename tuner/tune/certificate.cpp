// What a search may claim of the space that it was asked about.
#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "tuner/tune/tune.h"

namespace reliefbench {

std::string gap_text(double gap) {
  return std::isfinite(gap) ? fmt::format("{:.2f} %", 100 * gap) : std::string("an unknown share");
}

bool TuneResult::is_certified() const { return search.is_certified && counts.unscored == 0; }

double TuneResult::gap_in_space(double gap) const {
  return counts.unscored == 0 ? gap : std::numeric_limits<double>::infinity();
}

std::string TuneResult::claim() const {
  std::string part;
  if (counts.unscored > 0)
    part = fmt::format("{} of the {} settings were not scored: no statement about the whole space", counts.unscored,
                       counts.settings);
  if (search.answers.empty()) return "not certified: " + (part.empty() ? "there is no answer" : part);
  std::string within = fmt::format("every answer is within {} of the best", gap_text(search.worst_gap));
  if (fleet)
    within += fmt::format(", the fleet's setting loses at most {} where none loses less than {}", gap_text(fleet->high),
                          gap_text(fleet->low));
  within += fmt::format(", with {:.4g} % confidence", 100 * question.confidence);
  if (!part.empty()) return fmt::format("not certified: {}. Of the {} that were, {}", part, counts.scored, within);
  if (is_certified()) return "certified: " + within;
  return fmt::format("not certified to {}: {}", gap_text(question.epsilon), within);
}

}  // namespace reliefbench
