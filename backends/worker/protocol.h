#pragma once
#include <concepts>

#include "backends/backend.h"
#include "backends/worker/wire.h"

namespace reliefbench {

// What a host asks of its worker, and how the interface's types look in messages. A request is a Call, the ids of the
// objects that are to be freed before it, and its arguments; a reply is its Outcome, and what is returned or WireError.

enum class Call : std::uint8_t { list, open, upload, compile, compile_compute, render, read, compute, debug_messages };
enum class Outcome : std::uint8_t { done, failed };

/// Of a texture or a pipeline in the worker.
using ObjectId = std::uint64_t;
inline constexpr ObjectId kNoObject = 0;

struct WireError {
  Exit code = Exit::environment;
  Fault fault = Fault::other;
  std::string text;
};

struct WireDraw {
  ObjectId pipeline = kNoObject;
  std::vector<std::pair<std::string, ObjectId>> textures;
  std::span<const FrameUniforms> frame;  ///< one
  int vertices = 0;
};

template <typename T, typename Of>
concept Is = std::same_as<std::remove_const_t<T>, Of>;

auto members(Is<WireError> auto& x) { return std::tie(x.code, x.fault, x.text); }
auto members(Is<WireDraw> auto& x) { return std::tie(x.pipeline, x.textures, x.frame, x.vertices); }
auto members(Is<DeviceInfo> auto& x) {
  return std::tie(x.backend, x.index, x.name, x.vendor, x.type, x.driver, x.api_version, x.software, x.timers,
                  x.subtexel_bits, x.float64, x.blocks, x.compiles_in_parallel, x.pci);
}
auto members(Is<BackendOptions> auto& x) { return std::tie(x.debug, x.keeps_pipelines); }
auto members(Is<TexelLayout> auto& x) { return std::tie(x.type, x.channels); }
auto members(Is<TextureDesc> auto& x) {
  return std::tie(x.width, x.height, x.layout, x.levels, x.texels, x.wrap, x.filter);
}
auto members(Is<Attachment> auto& x) { return std::tie(x.name, x.layout); }
auto members(Is<Target> auto& x) { return std::tie(x.attachments, x.has_depth, x.by_compute); }
auto members(Is<SpecConstant> auto& x) { return std::tie(x.id, x.value); }
auto members(Is<PipelineDesc> auto& x) { return std::tie(x.label, x.vertex, x.fragment, x.constants, x.target); }
auto members(Is<ComputeDesc> auto& x) { return std::tie(x.label, x.spirv, x.buffers); }
auto members(Is<ComputeBuffer> auto& x) { return std::tie(x.bytes, x.contents); }
/// But for the pipeline, whose id stands beside.
auto members(Is<ComputePass> auto& x) {
  return std::tie(x.part, x.buffers, x.groups_x, x.groups_y, x.groups_z, x.argument, x.may_be_long);
}
auto members(Is<ComputeTime> auto& x) { return std::tie(x.part, x.ns); }
auto members(Is<BatchTime> auto& x) { return std::tie(x.wall_ns, x.device_ns); }

}  // namespace reliefbench
