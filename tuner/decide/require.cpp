#include "tuner/decide/require.h"

#include <algorithm>
#include <bit>
#include <limits>

namespace reliefbench {
namespace {

bool is_part_of(FeatureSet inner, FeatureSet outer) { return (inner & outer) == inner; }

/// The sets next under one: within it, with no other between.
std::vector<FeatureSet> sets_under(const FeatureSpace& space, FeatureSet set) {
  std::vector<FeatureSet> under;
  const auto is_under = [](FeatureSet a, FeatureSet b) { return a != b && is_part_of(a, b); };
  for (const FeatureSet one : space.sets)
    if (is_under(one, set) && std::ranges::none_of(space.sets, [&](FeatureSet between) {
          return is_under(one, between) && is_under(between, set);
        }))
      under.push_back(one);
  return under;
}

std::vector<FeatureSet> sets_over(const FeatureSpace& space, FeatureSet set) {
  std::vector<FeatureSet> over;
  for (const FeatureSet one : space.sets)
    if (const std::vector<FeatureSet> under = sets_under(space, one); std::ranges::find(under, set) != under.end())
      over.push_back(one);
  return over;
}

/// Looks at each set once.
class SetBook {
 public:
  SetBook(const SetError& error, double limit) : error_(error), limit_(limit) {}

  double error(FeatureSet set) {
    const auto known = std::ranges::find(judged_, set, &JudgedSet::set);
    if (known != judged_.end()) return known->error;
    judged_.push_back({.set = set, .error = error_(set)});
    return judged_.back().error;
  }
  bool is_good(FeatureSet set) { return error(set) <= limit_; }
  /// The one of least error, of the first of those; none of none.
  std::optional<FeatureSet> best_of(const std::vector<FeatureSet>& sets) {
    std::optional<FeatureSet> best;
    for (const FeatureSet set : sets)
      if (!best || error(set) < error(*best)) best = set;
    return best;
  }
  [[nodiscard]] Required answer() const {
    Required required{.smallest = {}, .judged = judged_};
    int least = std::numeric_limits<int>::max();
    for (const JudgedSet& one : judged_)
      if (one.error <= limit_) least = std::min(least, size_of(one.set));
    for (const JudgedSet& one : judged_)
      if (one.error <= limit_ && size_of(one.set) == least) required.smallest.push_back(one.set);
    return required;
  }

 private:
  const SetError& error_;
  double limit_;
  std::vector<JudgedSet> judged_;
};

/// While a feature may go: unseen, or for the better where the set is seen as it is.
void go_down(const FeatureSpace& space, FeatureSet set, SetBook& book) {
  for (;;) {
    const std::optional<FeatureSet> best = book.best_of(sets_under(space, set));
    if (!best || !(book.is_good(*best) || (!book.is_good(set) && book.error(*best) < book.error(set)))) return;
    set = *best;
  }
}

}  // namespace

bool has(FeatureSet set, std::size_t feature) { return ((set >> feature) & 1U) != 0; }
int size_of(FeatureSet set) { return std::popcount(set); }

std::optional<FeatureSet> largest_without(const FeatureSpace& space, FeatureSet set, std::size_t feature) {
  std::optional<FeatureSet> largest;
  for (const FeatureSet one : space.sets)
    if (is_part_of(one, set) && !has(one, feature) && (!largest || size_of(one) > size_of(*largest))) largest = one;
  return largest;
}

std::optional<FeatureSet> smallest_with(const FeatureSpace& space, FeatureSet set, std::size_t feature) {
  std::optional<FeatureSet> smallest;
  for (const FeatureSet one : space.sets)
    if (is_part_of(set, one) && has(one, feature) && (!smallest || size_of(one) < size_of(*smallest))) smallest = one;
  return smallest;
}

Required require_by_enumeration(const FeatureSpace& space, const SetError& error, double limit) {
  SetBook book(error, limit);
  for (const FeatureSet set : space.sets) static_cast<void>(book.error(set));
  return book.answer();
}

Required require_greedily(const FeatureSpace& space, const SetError& error, double limit) {
  SetBook book(error, limit);
  for (const FeatureSet set : space.sets)
    if (std::ranges::none_of(space.sets, [&](FeatureSet other) { return other != set && is_part_of(set, other); }))
      go_down(space, set, book);  // one that holds all, or several where not all go together
  FeatureSet set = 0;
  while (!book.is_good(set)) {
    const std::optional<FeatureSet> best = book.best_of(sets_over(space, set));
    if (!best) break;
    set = *best;
  }
  go_down(space, set, book);
  return book.answer();
}

}  // namespace reliefbench
