#pragma once
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "backends/backend.h"
#include "backends/shader_compiler.h"
#include "kernels/base/error.h"
#include "tests/thorough.h"

namespace reliefbench {

inline constexpr TexelLayout kFloat{.type = TexelType::float32, .channels = 1};
inline const Scene kScene{
    .view = {.id = "oblique", .elevation_deg = 30, .distance = 1.6, .fov_deg = 35}, .width_px = 40, .height_px = 24};

/// With the API's debug output.
inline std::unique_ptr<Backend> open_debug(const BackendRow& row, int index) {
  return row.open(index, {.debug = true});
}

/// One open device with what a draw needs.
struct Rig {
  Rig(const BackendRow& backend_row, int index)
      : row(backend_row), backend(open_debug(row, index)), vertex(compile_vertex(row.dialect)) {
    constexpr std::array<std::byte, 4> kWhite = {std::byte{255}, std::byte{255}, std::byte{255}, std::byte{255}};
    plain = backend->upload({.width = 1, .height = 1, .texels = kWhite});
  }

  [[nodiscard]] std::unique_ptr<Pipeline> pipeline(const Spirv& fragment, const Target& target,
                                                   std::vector<SpecConstant> constants = {},
                                                   std::string label = "test") const {
    return backend->compile({.label = std::move(label),
                             .vertex = vertex,
                             .fragment = fragment,
                             .constants = std::move(constants),
                             .target = target});
  }
  [[nodiscard]] std::unique_ptr<Pipeline> technique(std::string_view id, const Target& target) const {
    return pipeline(compile_fragment(id, target, row.dialect), target, {}, std::string(id));
  }
  /// relief, extra: null for the plain texture
  [[nodiscard]] Textures textures(const Texture* relief = nullptr, const Texture* extra = nullptr) const {
    return {{kReliefMap, relief != nullptr ? relief : plain.get()},
            {kNormalMap, plain.get()},
            {kReferenceMap, plain.get()},
            {kExtraMap, extra != nullptr ? extra : plain.get()}};
  }
  void draw(const Pipeline& pipeline, const Scene& scene, const Texture* relief = nullptr) const {
    const Draw draw{.pipeline = &pipeline, .textures = textures(relief), .frame = frame_uniforms(scene, 8, 8)};
    const BatchTime time = backend->render(draw, 1, Timer::fenced_wall);
    EXPECT_GT(time.wall_ns, 0);
    EXPECT_FALSE(time.device_ns);
  }

  const BackendRow& row;
  std::unique_ptr<Backend> backend;
  Spirv vertex;
  std::unique_ptr<Texture> plain;
  mutable std::map<std::string, std::unique_ptr<Pipeline>> kept{};  ///< by what they are compiled of: trace_frame()
};

/// One text runs on both APIs: of many cases alike each is tried on one of them, in turn.
inline bool is_tried_here(const Rig& rig, std::size_t number) { return is_turn(number, rig.row.id == "opengl"); }

/// The words of the Error(environment) that `action` throws.
inline std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Exit::environment) << error.what();
    return error.what();
  }
  return "no error";
}

/// Every test runs on every device of one backend.
class BackendTest : public ::testing::TestWithParam<std::string_view> {
 protected:
  void SetUp() override {
    if (row().devices().empty()) GTEST_SKIP() << "this machine has no device for " << row().id;
  }
  [[nodiscard]] static const BackendRow& row() { return find_backend(GetParam()); }

  template <typename Body>
  static void on_every_device(const Body& body) {
    for (const DeviceInfo& device : row().devices()) {
      SCOPED_TRACE(device.name);
      Rig rig(row(), device.index);
      body(rig);
      EXPECT_THAT(rig.backend->debug_messages(), ::testing::IsEmpty());
    }
  }
};

inline std::string backend_name(const ::testing::TestParamInfo<std::string_view>& param) {
  return std::string(param.param);
}

}  // namespace reliefbench
