#include "tuner/results/run_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "kernels/base/sha256.h"
#include "tuner/plan/shard.h"
#include "tuner/results/json_text.h"

namespace reliefbench {
namespace {

using nlohmann::json;

constexpr std::size_t kMostNamed = 8;  // missing shards, in a line

json part_of(const Run& run) {
  json part = {{"folder", run.folder.string()},
               {"records", run.records.size()},
               {"cases", run.info.value(json::json_pointer("/counts/cases"), 0)},
               {"devices", json::array()}};
  for (const char* key : {"identity", "version", "git_sha", "started", "started_unix_ns", "finished", "host", "wall_s"})
    if (run.info.contains(key)) part[key] = run.info[key];
  for (const json& device : run.info.value("devices", json::array())) {
    json& kept = part["devices"].emplace_back(json::object());
    for (const char* key : {"backend", "index", "timer", "control_reference_ns"})
      if (device.contains(key)) kept[key] = device[key];
  }
  return part;
}

bool is_whole(const json& part) {
  return part.value("finished", json()).is_string() && part.value("records", 0) >= part.value("cases", 0);
}

/// What is divided: all cases of a filter on some backends.
std::string plan_of(const json& identity) {
  std::string text = fmt::format("{}\n{}", identity.value("filter", ""), identity.value("case", ""));
  for (const json& device : identity.value("devices", json::array()))
    text += fmt::format("\n{}", device.value("backend", ""));
  return text;
}

/// One way to divide a plan: by index of its shards, the part that has most of it.
using Division = std::map<int, const json*>;

bool is_complete(const std::pair<const int, Division>& division) {
  return std::cmp_equal(division.second.size(), division.first) &&
         std::ranges::all_of(division.second, [](const auto& shard) { return is_whole(*shard.second); });
}

std::string missing_in(int of, const Division& division) {
  std::vector<std::string> words;
  std::vector<int> absent;
  for (int index = 1; index <= of; ++index)
    if (!division.contains(index)) absent.push_back(index);
  if (!absent.empty()) {
    const std::size_t named = std::min(absent.size(), kMostNamed);
    const std::string more = named < absent.size() ? fmt::format(" and {} more", absent.size() - named) : "";
    words.push_back(fmt::format("shard{} {}{} of {} {} missing", absent.size() == 1 ? "" : "s",
                                fmt::join(absent.begin(), absent.begin() + static_cast<std::ptrdiff_t>(named), ", "),
                                more, of, absent.size() == 1 ? "is" : "are"));
  }
  for (const auto& [index, part] : division)
    if (!is_whole(*part))
      words.push_back(fmt::format("{} is unfinished ({} of {} cases)",
                                  of == 1 ? part->value("folder", "") : fmt::format("shard {} of {}", index, of),
                                  part->value("records", 0), part->value("cases", 0)));
  return fmt::format("{}", fmt::join(words, "; "));
}

}  // namespace

std::vector<json> parts_of(const Run& run) {
  if (run.info.contains("parts")) return run.info["parts"].get<std::vector<json>>();
  return {part_of(run)};
}

std::string part_key(const json& part) {
  const json started_ns = part.value("started_unix_ns", json());
  if (!started_ns.is_number()) return "";
  return sha256(json_text(json::array({part.value("identity", json()), started_ns}), -1));
}

std::vector<std::string> part_keys(const json& info) {
  std::vector<std::string> keys;
  if (!info.is_object()) return keys;
  for (const json& part : info.value("parts", json::array({info})))
    if (std::string key = part_key(part); !key.empty() && !part.contains(kAddsNothing)) keys.push_back(std::move(key));
  return keys;
}

std::string missing_of(std::span<const json> parts) {
  std::map<std::string, std::map<int, Division>> plans;
  for (const json& part : parts) {
    const json identity = part.value("identity", json::object());
    const Shard shard = parse_shard(identity.value("shard", "1/1"));
    const json*& held = plans[plan_of(identity)][shard.of][shard.index];
    const auto worth = [](const json& one) { return std::pair(is_whole(one), one.value("records", 0)); };
    if (held == nullptr || worth(*held) < worth(part)) held = &part;
  }
  std::vector<std::string> texts;
  for (const auto& [plan, divisions] : plans) {
    if (std::ranges::any_of(divisions, is_complete)) continue;
    const auto share = [](const auto& division) {
      return static_cast<double>(division.second.size()) / division.first;
    };
    const auto nearest = std::ranges::max_element(divisions, {}, share);
    texts.push_back(missing_in(nearest->first, nearest->second));
  }
  return fmt::format("{}", fmt::join(texts, "; "));
}

std::string how_to_finish(const Run& run) {
  if (!run.info.at("identity").contains("merged")) return "the command that began it goes on with it";
  const std::string missing = missing_of(parts_of(run));
  return missing.empty() ? "merge its finished parts" : missing + "; merge them, too";
}

}  // namespace reliefbench
