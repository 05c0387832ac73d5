#include "tuner/decide/case_groups.h"

#include <array>
#include <map>
#include <set>

namespace reliefbench {

std::vector<std::pair<std::string, std::vector<std::size_t>>> case_groups(std::span<const CaseTraits> cases) {
  std::array<std::map<std::string, std::vector<std::size_t>>, 3> by_name;
  std::vector<std::size_t> all;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    all.push_back(i);
    by_name[0]["technique=" + cases[i].technique].push_back(i);
    by_name[1]["map=" + cases[i].map].push_back(i);
    by_name[2]["format=" + cases[i].format].push_back(i);
  }
  std::vector<std::pair<std::string, std::vector<std::size_t>>> groups;
  std::set<std::vector<std::size_t>> seen;
  const auto add = [&](const std::string& name, const std::vector<std::size_t>& members) {
    if (members.size() > 1 && !name.ends_with('=') && seen.insert(members).second) groups.emplace_back(name, members);
  };
  add("", all);
  for (const auto& names : by_name)
    for (const auto& [name, members] : names) add(name, members);
  return groups;
}

}  // namespace reliefbench
