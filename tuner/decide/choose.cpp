#include "tuner/decide/choose.h"

#include <algorithm>
#include <vector>

#include "tuner/plan/features.h"

namespace reliefbench {

Simplicity simplicity(const Settings& settings) {
  return {.features = features(settings).size(),
          .technique = static_cast<std::size_t>(&settings.technique() - techniques().data())};
}

Settings settings_of(const Record& record) {
  Settings settings(find_technique(record.technique));
  for (const auto& [id, text] : record.params) settings.set(id, text);
  return settings;
}

Simplicity simplicity(const Record& record) { return simplicity(settings_of(record)); }

Choice choose(std::span<const Contender> contenders) {
  const auto leader = std::ranges::min_element(contenders, {}, &Contender::high_ns);
  std::vector<std::size_t> tied;
  for (std::size_t i = 0; i < contenders.size(); ++i)
    if (contenders[i].low_ns <= leader->high_ns) tied.push_back(i);  // its end is no earlier than the leader's
  const auto rank = [&](std::size_t i) { return contenders[i].rank(); };
  Choice choice{.pick = *std::ranges::min_element(tied, {}, rank), .ties = tied.size() - 1};
  std::erase(tied, choice.pick);
  if (!tied.empty())
    choice.tie = *std::ranges::min_element(tied, {}, [&](std::size_t i) { return contenders[i].high_ns; });
  return choice;
}

}  // namespace reliefbench
