#include <benchmark/benchmark.h>
#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numbers>
#include <vector>

#include "kernels/judge/reference.h"

// One core, one ray at a time: the exact tracer against Embree's rtcIntersect1 on a triangulation of the same texels,
// over the same perspective rays: `trace_exact_first_hit` does the same job, `trace_exact` finds the exit from the
// solid, too. The ratio of the two items_per_second is the figure to look at.
namespace {

using namespace reliefbench;

constexpr int kFrame = 512;
constexpr double kDepth = 0.1;  // of the relief, in sides of the map

/// Six octaves of value noise, stretched to [0,1].
Heightfield terrain(int side) {
  const auto noise = [](int x, int y) {
    auto h = static_cast<std::uint32_t>(x) * 0x9E3779B1u ^ static_cast<std::uint32_t>(y) * 0x85EBCA77u;
    h = (h ^ (h >> 15)) * 0x2C1B3C6Du;
    h = (h ^ (h >> 12)) * 0x297A2D39u;
    return static_cast<double>(h ^ (h >> 15)) / 4294967296.0;
  };
  Heightfield map{.width = side, .height = side, .texels = {}};
  double low = 1e9;
  double high = -1e9;
  std::vector<double> heights;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      double sum = 0;
      double weight = 1;
      for (int frequency = 4; frequency <= 128; frequency *= 2, weight /= 2) {
        const double u = static_cast<double>(x) * frequency / side;
        const double v = static_cast<double>(y) * frequency / side;
        const int i = static_cast<int>(u);
        const int j = static_cast<int>(v);
        const double fu = (u - i) * (u - i) * (3 - 2 * (u - i));
        const double fv = (v - j) * (v - j) * (3 - 2 * (v - j));
        sum += weight * std::lerp(std::lerp(noise(i, j), noise(i + 1, j), fu),
                                  std::lerp(noise(i, j + 1), noise(i + 1, j + 1), fu), fv);
      }
      heights.push_back(sum);
      low = std::min(low, sum);
      high = std::max(high, sum);
    }
  }
  for (const double h : heights) map.texels.push_back(static_cast<float>((h - low) / (high - low)));
  return map;
}

/// A 45-degree frame of rays at the centre of the map; those that stay inside the map all the way down.
std::vector<TextureRay> perspective_rays(double elevation_deg) {
  const double elevation = elevation_deg * std::numbers::pi / 180;
  const double forward_y = std::cos(elevation);
  const double forward_z = -std::sin(elevation);
  const double half = std::tan(22.5 * std::numbers::pi / 180);
  const double distance = 0.7;
  std::vector<TextureRay> rays;
  for (int y = 0; y < kFrame; ++y) {
    for (int x = 0; x < kFrame; ++x) {
      const double across = (2 * (x + 0.5) / kFrame - 1) * half;
      const double up = (1 - 2 * (y + 0.5) / kFrame) * half;
      const double z = forward_z + up * forward_y;
      if (z >= -1e-3) continue;
      const double slope_u = across / -z;
      const double slope_v = (forward_y - up * forward_z) / -z;
      const double height = -distance * forward_z;
      const TextureRay ray{.u = static_cast<float>(0.5 + slope_u * height),
                           .v = static_cast<float>(0.5 - distance * forward_y + slope_v * height),
                           .slope_u = static_cast<float>(slope_u * kDepth),
                           .slope_v = static_cast<float>(slope_v * kDepth)};
      const auto inside = [](double c) { return c > 0.01 && c < 0.99; };
      if (inside(ray.u) && inside(ray.v) && inside(ray.u + ray.slope_u) && inside(ray.v + ray.slope_v)) {
        rays.push_back(ray);
      }
    }
  }
  return rays;
}

struct Release {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};

enum class Mesh { triangles, grid };

/// Embree's scene: vertices at texel centres in uv, height up.
class EmbreeMap {
 public:
  EmbreeMap(const Heightfield& map, Mesh mesh)
      : device_(rtcNewDevice("threads=1")), scene_(rtcNewScene(device_.get())) {
    const bool is_grid = mesh == Mesh::grid;
    RTCGeometry geometry = rtcNewGeometry(device_.get(), is_grid ? RTC_GEOMETRY_TYPE_GRID : RTC_GEOMETRY_TYPE_TRIANGLE);
    const auto count = static_cast<std::size_t>(map.width) * static_cast<std::size_t>(map.height);
    auto* vertices = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), count));
    for (int y = 0; y < map.height; ++y) {
      for (int x = 0; x < map.width; ++x) {
        *vertices++ = (static_cast<float>(x) + 0.5F) / static_cast<float>(map.width);
        *vertices++ = (static_cast<float>(y) + 0.5F) / static_cast<float>(map.height);
        *vertices++ = map.at(x, y);
      }
    }
    if (is_grid) {
      auto* grid = static_cast<RTCGrid*>(
          rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_GRID, 0, RTC_FORMAT_GRID, sizeof(RTCGrid), 1));
      *grid = {.startVertexID = 0,
               .stride = static_cast<unsigned>(map.width),
               .width = static_cast<unsigned short>(map.width),
               .height = static_cast<unsigned short>(map.height)};
    } else {
      const auto quads = static_cast<std::size_t>(map.width - 1) * static_cast<std::size_t>(map.height - 1);
      auto* index = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                   3 * sizeof(unsigned), 2 * quads));
      const auto stride = static_cast<unsigned>(map.width);
      for (unsigned y = 0; y + 1 < static_cast<unsigned>(map.height); ++y) {
        for (unsigned x = 0; x + 1 < stride; ++x) {
          const unsigned i = y * stride + x;
          for (const unsigned corner : {i, i + 1, i + stride, i + 1, i + stride + 1, i + stride}) *index++ = corner;
        }
      }
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_.get(), geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_.get());
  }

  [[nodiscard]] float trace(const TextureRay& ray) const {
    RTCIntersectContext context{};
    rtcInitIntersectContext(&context);
    RTCRayHit query{};
    query.ray = {.org_x = ray.u,
                 .org_y = ray.v,
                 .org_z = 1,
                 .tnear = 0,
                 .dir_x = ray.slope_u,
                 .dir_y = ray.slope_v,
                 .dir_z = -1,
                 .time = 0,
                 .tfar = 2,
                 .mask = ~0u,
                 .id = 0,
                 .flags = 0};
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene_.get(), &context, &query);
    return query.ray.tfar;
  }

 private:
  std::unique_ptr<RTCDeviceTy, Release> device_;
  std::unique_ptr<RTCSceneTy, Release> scene_;
};

/// What rtcIntersect1 answers: the first hit alone.
struct FirstHit {
  ReferenceTracer tracer;
  [[nodiscard]] double trace(const TextureRay& ray) const { return tracer.first_hit(ray); }
};

template <typename Tracer>
void time_rays(benchmark::State& state, const Tracer& tracer) {
  const std::vector<TextureRay> rays = perspective_rays(static_cast<double>(state.range(1)));
  for (auto _ : state) {
    for (const TextureRay& ray : rays) benchmark::DoNotOptimize(tracer.trace(ray));
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(rays.size()));
  state.counters["rays"] = static_cast<double>(rays.size());
}

void trace_exact(benchmark::State& state) {
  time_rays(state, ReferenceTracer(terrain(static_cast<int>(state.range(0))), Wrap::clamp));
}
void trace_exact_first_hit(benchmark::State& state) {
  time_rays(state, FirstHit{ReferenceTracer(terrain(static_cast<int>(state.range(0))), Wrap::clamp)});
}
void trace_embree_triangles(benchmark::State& state) {
  time_rays(state, EmbreeMap(terrain(static_cast<int>(state.range(0))), Mesh::triangles));
}
void trace_embree_grid(benchmark::State& state) {
  time_rays(state, EmbreeMap(terrain(static_cast<int>(state.range(0))), Mesh::grid));
}

const std::vector<std::vector<std::int64_t>> kSidesAndElevations{{512, 4096}, {30, 8}};
BENCHMARK(trace_exact_first_hit)
    ->ArgNames({"side", "deg"})
    ->ArgsProduct(kSidesAndElevations)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(trace_exact)->ArgNames({"side", "deg"})->ArgsProduct(kSidesAndElevations)->Unit(benchmark::kMillisecond);
BENCHMARK(trace_embree_triangles)
    ->ArgNames({"side", "deg"})
    ->ArgsProduct(kSidesAndElevations)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(trace_embree_grid)
    ->ArgNames({"side", "deg"})
    ->ArgsProduct(kSidesAndElevations)
    ->Unit(benchmark::kMillisecond);

}  // namespace
