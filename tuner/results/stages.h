#pragma once
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace reliefbench {

/// A step from inputs to a number that a run or the cache keeps, and the version of the code that does it.
struct StageVersion {
  std::string id;
  int version;
};

/// The one list. A stage's version is raised by hand when its results change; what is kept under the old one is then
/// made again, and unfinished runs are not gone on with.
///   bake.KIND  a map's values from heights (MapRow::version)
///   encode     ratios and heights to texel codes
///   pack       values to textures, mip levels, normals
///   trace      a frame from textures: uniforms, constants, draw state (shaders' texts and SPIR-V are inputs)
///   reference  exact hits of rays (ReferenceTracer::kVersion)
///   judge      errors of hits and pictures
///   harness    how frames are timed
[[nodiscard]] const std::vector<StageVersion>& stage_versions();

/// The key of what `stages` make of `inputs`, SHA-256 in hex. Every input is an item of its own: which text stands
/// where counts. All cache keys and all keys of records are made here. stages: ids of stage_versions()
[[nodiscard]] std::string stage_key(std::initializer_list<std::string_view> stages,
                                    std::initializer_list<std::string_view> inputs,
                                    const std::vector<StageVersion>& versions = stage_versions());

/// "bake.KIND"
[[nodiscard]] std::string bake_stage(std::string_view map_id);

}  // namespace reliefbench
