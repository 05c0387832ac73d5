#include "tuner/results/stages.h"

#include <fmt/format.h>

#include <algorithm>

#include "kernels/base/error.h"
#include "kernels/base/sha256.h"
#include "kernels/judge/reference.h"
#include "kernels/maps/map_kind.h"

namespace reliefbench {
namespace {

const StageVersion& find_stage(std::string_view id, const std::vector<StageVersion>& all) {
  const auto found = std::ranges::find(all, id, &StageVersion::id);
  if (found == all.end()) fail_input("unknown stage '{}'", id);
  return *found;
}

}  // namespace

const std::vector<StageVersion>& stage_versions() {
  static const std::vector<StageVersion> versions = [] {
    std::vector<StageVersion> list;
    for (const MapRow& row : map_kinds()) list.push_back({.id = bake_stage(row.id), .version = row.version});
    list.insert(list.end(), {{.id = "encode", .version = 2},
                             {.id = "pack", .version = 1},
                             {.id = "trace", .version = 3},
                             {.id = "reference", .version = ReferenceTracer::kVersion},
                             {.id = "judge", .version = 6},
                             {.id = "harness", .version = 2}});
    return list;
  }();
  return versions;
}

std::string stage_key(std::initializer_list<std::string_view> stages, std::initializer_list<std::string_view> inputs,
                      const std::vector<StageVersion>& versions) {
  std::string text;
  for (const std::string_view id : stages) text += fmt::format("{} {}\n", id, find_stage(id, versions).version);
  for (const std::string_view input : inputs) text += fmt::format("{}:{}\n", input.size(), input);
  return sha256(text);
}

std::string bake_stage(std::string_view map_id) { return fmt::format("bake.{}", map_id); }

}  // namespace reliefbench
