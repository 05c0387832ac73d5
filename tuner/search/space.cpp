#include "tuner/search/space.h"

#include <cmath>
#include <unordered_set>

#include "kernels/base/error.h"

namespace reliefbench {

void SearchSpace::check() const {
  if (candidates.empty()) fail_input("there is no setting to search among");
  std::unordered_set<std::string> seen;
  for (const Candidate& candidate : candidates) {
    if (!seen.insert(candidate.id).second) fail_input("setting '{}' is in the space twice", candidate.id);
    if (!(candidate.error >= 0)) fail_input("setting '{}' has error {}", candidate.id, candidate.error);
    if (candidate.categories.size() != category_axes.size() || candidate.steps.size() != step_axes.size())
      fail_input("setting '{}' has {} categories and {} step counts, the space {} and {}", candidate.id,
                 candidate.categories.size(), candidate.steps.size(), category_axes.size(), step_axes.size());
    if (candidate.work.size() != work_axes.size())
      fail_input("setting '{}' has {} counts of work, the space {}", candidate.id, candidate.work.size(),
                 work_axes.size());
    for (const double work : candidate.work)
      if (!(work >= 0) || std::isinf(work)) fail_input("setting '{}' has {} of work", candidate.id, work);
  }
}

}  // namespace reliefbench
