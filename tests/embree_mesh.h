#pragma once
#include <embree3/rtcore.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "kernels/trace/mesh_tracer.h"

namespace reliefbench {

/// A displaced mesh of triangles as Embree has it: each triangle of the mesh in steps^2 parts.
class EmbreeMesh {
 public:
  EmbreeMesh(const Mesh& mesh, const Heightfield& map, const MeshRelief& relief, int steps)
      : device_(rtcNewDevice("threads=1")), scene_(rtcNewScene(device_.get())) {
    rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_ROBUST);
    RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
    std::vector<float> points;
    std::vector<unsigned> corners;
    for (const auto& triangle : mesh.triangles) {
      const auto first = static_cast<unsigned>(points.size() / 3);
      for (int j = 0; j <= steps; ++j)
        for (int i = 0; i <= steps - j; ++i) {
          const Eigen::Vector3d p =
              displaced(mesh, triangle, map, relief, static_cast<double>(i) / steps, static_cast<double>(j) / steps);
          for (const double x : p) points.push_back(static_cast<float>(x));
        }
      const auto at = [&](int i, int j) {
        return first + static_cast<unsigned>(j * (steps + 1) - j * (j - 1) / 2 + i);
      };
      for (int j = 0; j < steps; ++j)
        for (int i = 0; i < steps - j; ++i) {
          corners.insert(corners.end(), {at(i, j), at(i + 1, j), at(i, j + 1)});
          if (i + j + 1 < steps) corners.insert(corners.end(), {at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    }
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                                 3 * sizeof(float), points.size() / 3));
    std::ranges::copy(points, vertices);
    auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                   3 * sizeof(unsigned), corners.size() / 3));
    std::ranges::copy(corners, indices);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_.get(), geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_.get());
  }

  /// The way to the first hit from either side; infinity: none.
  [[nodiscard]] double first_hit(const MeshLine& line) const {
    RTCIntersectContext context{};
    rtcInitIntersectContext(&context);
    RTCRayHit query{};
    query.ray = {.org_x = static_cast<float>(line.from.x()),
                 .org_y = static_cast<float>(line.from.y()),
                 .org_z = static_cast<float>(line.from.z()),
                 .tnear = 0,
                 .dir_x = static_cast<float>(line.direction.x()),
                 .dir_y = static_cast<float>(line.direction.y()),
                 .dir_z = static_cast<float>(line.direction.z()),
                 .time = 0,
                 .tfar = std::numeric_limits<float>::infinity(),
                 .mask = ~0U,
                 .id = 0,
                 .flags = 0};
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene_.get(), &context, &query);
    return static_cast<double>(query.ray.tfar);
  }

 private:
  struct Release {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  };

  static double bilinear(const Heightfield& map, const Eigen::Vector2d& texel) {
    const double x = texel.x() - 0.5;
    const double y = texel.y() - 0.5;
    const int i = static_cast<int>(std::floor(x));
    const int j = static_cast<int>(std::floor(y));
    const auto at = [&](int k, int l) {
      return static_cast<double>(map.at(wrapped(k, map.width, Wrap::repeat), wrapped(l, map.height, Wrap::repeat)));
    };
    return std::lerp(std::lerp(at(i, j), at(i + 1, j), x - i), std::lerp(at(i, j + 1), at(i + 1, j + 1), x - i), y - j);
  }

  static Eigen::Vector3d displaced(const Mesh& mesh, const std::array<std::uint32_t, 3>& triangle,
                                   const Heightfield& map, const MeshRelief& relief, double b, double c) {
    const MeshVertex& v0 = mesh.vertices[triangle[0]];
    const MeshVertex& v1 = mesh.vertices[triangle[1]];
    const MeshVertex& v2 = mesh.vertices[triangle[2]];
    const double a = 1 - b - c;
    const Eigen::Vector2d uv = (v0.uv * a + v1.uv * b + v2.uv * c) * relief.tiling;
    const double h = bilinear(map, {uv.x() * map.width, uv.y() * map.height});
    return v0.position * a + v1.position * b + v2.position * c +
           (v0.normal * a + v1.normal * b + v2.normal * c).normalized() * ((h - 1) * relief.depth);
  }

  std::unique_ptr<RTCDeviceTy, Release> device_;
  std::unique_ptr<RTCSceneTy, Release> scene_;
};

}  // namespace reliefbench
