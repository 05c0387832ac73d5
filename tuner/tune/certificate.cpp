// What a search may claim of the space that it was asked about.
#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "tuner/tune/tune.h"

namespace reliefbench {
namespace {

std::string percent(double ratio) {
  return std::isfinite(ratio) ? fmt::format("{:.2f} %", 100 * ratio) : std::string("an unknown share");
}

}  // namespace

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
  std::string within = fmt::format("every answer is within {} of the best", percent(search.worst_gap));
  if (fleet)
    within += fmt::format(", the fleet's setting loses at most {} where none loses less than {}", percent(fleet->high),
                          percent(fleet->low));
  within += fmt::format(", with {:.4g} % confidence", 100 * question.confidence);
  if (!part.empty()) return fmt::format("not certified: {}. Of the {} that were, {}", part, counts.scored, within);
  if (is_certified()) return "certified: " + within;
  return fmt::format("not certified to {}: {}", percent(question.epsilon), within);
}

}  // namespace reliefbench
