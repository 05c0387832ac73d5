// Meshes as a scene's surface: rays against the C++ twin, frames against the exact hits and their picture, both
// backends; what configs may say of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "kernels/judge/depth_range.h"
#include "kernels/mesh/meshes.h"
#include "kernels/trace/mesh_frame.h"
#include "kernels/trace/surface.h"
#include "kernels/trace/surface_tracer.h"
#include "tests/technique_rig.h"
#include "tests/temp_folder.h"
#include "tuner/measure/frame_draws.h"
#include "tuner/measure/prepare.h"
#include "tuner/plan/config.h"
#include "tuner/plan/scene_json.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

Scene mesh_scene(const std::string& mesh, int segments, double relief_depth, int side_px = 64) {
  return {.view = {.id = "whole", .elevation_deg = 35, .distance = 2, .fov_deg = 28, .azimuth_deg = 20},
          .relief_depth = relief_depth,
          .width_px = side_px,
          .height_px = side_px,
          .surface = {.kind = SurfaceKind::mesh, .mesh = mesh, .segments = segments}};
}

Heightfield level_map(float height) {
  return {.width = 32, .height = 32, .texels = std::vector<float>(32UL * 32, height)};
}

/// A session that draws score frames of meshes.
struct MeshRig {
  explicit MeshRig(const BackendRow& row, int device)
      : session(row, device, split, {.audits = Audits::none, .open = open_debug}) {}

  std::vector<ScorePixel> trace(const Settings& settings, const Heightfield& heights, const Scene& scene) {
    const UploadedScene uploaded = upload(session.backend(), scene, heights);
    const BakedMap map = bake(bake_spec(settings, scene.wrap), heights);
    const Frame frame = upload(session.backend(), pack(settings, map, scene), uploaded);
    return trace_frame(session.backend(), scored_draws(session, settings, scene, frame.draw));
  }
  JudgedFrame judged(const Settings& settings, const Heightfield& heights, const Scene& scene) {
    const std::vector<ScorePixel> pixels = trace(settings, heights, scene);
    const Mesh mesh = load_mesh(scene.surface);
    const FrameUniforms frame = frame_uniforms(scene, heights.width, heights.height);
    return judge(frame, scene.wrap, false, pixels,
                 exact_hits(ReferenceTracer(heights, scene.wrap), frame, scene.wrap, pixels, &mesh));
  }

  WallSplit split;
  Session session;
};

class MeshSurfaceTest : public BackendTest {
 protected:
  template <typename Body>
  static void on_every_rig(const Body& body) {
    for (const DeviceInfo& device : row().devices()) {
      SCOPED_TRACE(device.name);
      MeshRig rig(row(), device.index);
      body(rig);
      EXPECT_THAT(rig.session.backend().debug_messages(), ::testing::IsEmpty());
    }
  }
};
INSTANTIATE_TEST_SUITE_P(AllBackends, MeshSurfaceTest, ::testing::Values("opengl", "vulkan"), backend_name);

std::size_t pixels_with(const std::vector<ScorePixel>& pixels, PixelStatus status) {
  return static_cast<std::size_t>(std::ranges::count(pixels, static_cast<float>(status), &ScorePixel::status));
}

// A device's corners lie on a grid of 1/256 pixel: on edges an exact line may meet another triangle, or none.
TEST_P(MeshSurfaceTest, has_the_rays_of_its_twin) {
  on_every_rig([](MeshRig& rig) {
    for (const auto& [name, segments] : {std::pair("teapot", 4), {"torus", 3}}) {
      const Scene scene = mesh_scene(name, segments, 0.02, 96);
      const std::vector<ScorePixel> pixels = rig.trace(settings_of("flat"), small_fbm(), scene);
      const Mesh mesh = load_mesh(scene.surface);
      const FrameUniforms uniforms = frame_uniforms(scene, 32, 32);
      const ReferenceTracer heights(small_fbm(), scene.wrap);
      const MeshFrame frame(heights, mesh, uniforms);
      int rays = 0;
      int on_other_side = 0;
      std::vector<double> uv_apart;
      std::vector<double> slope_apart;
      for (int y = 0; y < scene.height_px; ++y)
        for (int x = 0; x < scene.width_px; ++x) {
          const ScorePixel& pixel = pixels[static_cast<std::size_t>(y * scene.width_px + x)];
          const auto entry = frame.entry(x, y);
          const bool has_ray = pixel.status != static_cast<float>(PixelStatus::no_ray);
          on_other_side += has_ray == entry.has_value() ? 0 : 1;
          if (!has_ray || !entry) continue;
          ++rays;
          const TextureRay& ray = pixel.ray;
          Eigen::Array2d apart = entry->ray.uv.array() - Eigen::Array2f(ray.u, ray.v).cast<double>();
          apart -= apart.round();
          uv_apart.push_back(apart.matrix().norm());
          slope_apart.push_back((entry->ray.slope - Eigen::Vector2f(ray.slope_u, ray.slope_v).cast<double>()).norm() /
                                (0.01 + entry->ray.slope.norm()));
        }
      EXPECT_GT(rays, 1500) << name;
      EXPECT_LE(on_other_side, rays / 100) << name;
      std::ranges::sort(uv_apart);
      std::ranges::sort(slope_apart);
      const std::size_t most = uv_apart.size() * 98 / 100;
      EXPECT_LT(uv_apart[most], 0.002) << name;
      EXPECT_LT(slope_apart[most], 0.02) << name;
      const auto exact = exact_hits(heights, uniforms, scene.wrap, pixels, &mesh);
      EXPECT_LE(std::ranges::count_if(exact, is_unknown), rays / 50) << name;
    }
  });
}

TEST_P(MeshSurfaceTest, every_technique_draws_the_mesh_itself_where_the_relief_is_level) {
  on_every_rig([](MeshRig& rig) {
    const Scene scene = mesh_scene("torus", 2, 0.02, 24);
    for (const Technique& technique : techniques()) {
      if (technique.id == "depth_slices") continue;  // no slice is the top plate
      for (const char* silhouette : {"none", "quadric", "quadric_exact"}) {
        Settings settings(technique);
        if (technique.find("silhouette") != nullptr) settings.set("silhouette", silhouette);
        if (!conflict(settings, scene, settings.technique().is_of_solids()).empty()) continue;
        if (GetParam() == "opengl" && !frame_features(settings).empty()) continue;  // other tests bend rays on it
        const FrameScore score = rig.judged(settings, level_map(1), scene).score;
        EXPECT_GT(score.pixels, 80) << settings.text();
        EXPECT_EQ(score.at("false_kill_rate"), 0) << technique.id << settings.text();
        EXPECT_EQ(score.at("false_keep_rate"), 0) << technique.id << settings.text();
        EXPECT_LE(score.at("e_xy.max"), 0.05) << technique.id << settings.text();
      }
    }
  });
}

TEST_P(MeshSurfaceTest, a_quadric_of_its_curvature_finds_the_silhouette) {
  on_every_rig([](MeshRig& rig) {
    const Scene scene = mesh_scene("torus", 8, 0.04, 64);
    const auto score = [&](const Heightfield& heights, const char* silhouette) {
      return rig.judged(settings_of("max_mip", {{"format", "r32f"}, {"silhouette", silhouette}}), heights, scene).score;
    };
    const FrameScore plane = score(level_map(0.25F), "none");
    const FrameScore quadric = score(level_map(0.25F), "quadric");
    EXPECT_GT(plane.at("false_keep_rate"), 0.03);
    EXPECT_LT(quadric.at("false_keep_rate"), 0.35 * plane.at("false_keep_rate"));
    EXPECT_LT(quadric.at("false_kill_rate"), 0.03);
    EXPECT_LT(score(small_fbm(), "quadric").at("e_xy.mean"), 0.7 * score(small_fbm(), "none").at("e_xy.mean"));
  });
}

// What is hidden by a nearer triangle is not drawn whatever the order, and a ray that passes shows no farther one.
TEST_P(MeshSurfaceTest, hits_before_they_are_behind) {
  on_every_rig([](MeshRig& rig) {
    const Scene scene = mesh_scene("teapot", 4, 0.02, 96);
    const Settings settings = settings_of("max_mip", {{"format", "r32f"}, {"silhouette", "quadric"}});
    const std::vector<ScorePixel> pixels = rig.trace(settings, small_fbm(), scene);
    EXPECT_GT(pixels_with(pixels, PixelStatus::hit), 1500U);
    EXPECT_GT(pixels_with(pixels, PixelStatus::passed), 10U);
    const FrameScore score = rig.judged(settings, small_fbm(), scene).score;
    EXPECT_LT(score.at("e_xy.p95"), 1.5);
    EXPECT_LT(score.at("false_kill_rate"), 0.02);
    // A handle that is hardly rounder than the relief is deep leaves some.
    const Settings plain = settings_of("max_mip", {{"format", "r32f"}});
    EXPECT_LT(score.at("false_keep_rate"), 0.8 * rig.judged(plain, small_fbm(), scene).score.at("false_keep_rate"));
  });
}

/// A case's error, and its pictures.
std::pair<FrameScore, CasePictures> prepared_mesh(std::string_view backend, const Settings& settings,
                                                  const Scene& scene, const HeightmapSpec& heightmap) {
  const TempFolder folder;
  const Cache cache(folder / "cache");
  WallSplit split;
  MapLibrary library(cache, split);
  Session session(find_backend(backend), 0, split, {.audits = Audits::none});
  Preparer preparer(
      {.session = session, .library = library, .cache = cache, .split = split, .timeout_s = 60, .flicker_frames = 0});
  const SceneSpec spec{.id = "map/whole_mesh", .heightmap = heightmap, .scene = scene};
  const Case c{.settings = settings, .scene_id = spec.id, .backend = std::string(backend)};
  const PreparedCase prepared = preparer.prepare(c, spec);
  EXPECT_EQ(prepared.record.status, Status::ok) << prepared.record.reason;
  return {prepared.record.error.value_or(FrameScore{}), preparer.pictures(c, spec)};
}

// The picture of exact hits is made of other numbers than a frame's: corners fetched by the hit's triangle.
TEST_P(MeshSurfaceTest, is_compared_with_the_picture_of_its_exact_hits) {
  const auto flip = [&](const Settings& settings, double relief_depth) {
    return prepared_mesh(GetParam(), settings, mesh_scene("teapot", 4, relief_depth, 96),
                         {.source = "fbm", .width = 32, .height = 32})
        .first.at("flip");
  };
  const Settings exact = settings_of("max_mip", {{"format", "r32f"}, {"silhouette", "quadric"}});
  EXPECT_LT(flip(exact, 0), 0.004);
  EXPECT_LT(flip(exact, 0.02), 0.7 * flip(settings_of("flat"), 0.02));
}

TEST_P(MeshSurfaceTest, may_be_supersampled_and_hidden) {
  Scene scene = mesh_scene("torus", 2, 0.02, 32);
  scene.reference = Picture::supersampled;
  scene.occluded = 0.5;
  const HeightmapSpec map{.source = "fbm", .width = 32, .height = 32};
  const auto [score, pictures] = prepared_mesh(GetParam(), settings_of("cone"), scene, map);
  EXPECT_GT(score.pixels, 150);
  EXPECT_EQ(pictures.frame[3], static_cast<int>(SeenObject::occluder));  // top left
  EXPECT_GT(score.at("flip"), 0);
}

TEST(MeshSurface, is_the_same_on_both_backends) {
  if (opengl_devices().empty() || vulkan_devices().empty()) GTEST_SKIP() << "needs both";
  MeshRig opengl(find_backend("opengl"), 0);
  MeshRig vulkan(find_backend("vulkan"), 0);
  const Scene scene = mesh_scene("teapot", 3, 0.02, 96);
  const Settings settings = settings_of("cone", {{"silhouette", "quadric"}});
  const std::vector<ScorePixel> a = opengl.trace(settings, small_fbm(), scene);
  const std::vector<ScorePixel> b = vulkan.trace(settings, small_fbm(), scene);
  int differ = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    if (a[i].status != b[i].status || std::abs(a[i].t - b[i].t) > 1e-3F) ++differ;
  EXPECT_LE(differ, static_cast<int>(pixels_with(a, PixelStatus::hit)) / 50);
}

TEST(MeshSurface, refuses_what_it_cannot_have) {
  const Scene scene = mesh_scene("teapot", 4, 0.02);
  const auto why = [&](std::string_view setting) { return conflict(parse_setting(setting), scene, false); };
  EXPECT_EQ(why("cone?silhouette=quadric&lod=footprint&normals=footprint"), "");
  EXPECT_THAT(why("cone?shadow=cone"), HasSubstr("given by numbers, not a mesh"));
  EXPECT_THAT(why("cone?depth=write"), HasSubstr("given by numbers, not a mesh"));
  EXPECT_THAT(why("cone?silhouette=clip"), HasSubstr("wrap=clamp"));
  EXPECT_THAT(why("depth_passes"), HasSubstr("needs a plane, not a mesh"));
  Scene clamped = scene;
  clamped.wrap = Wrap::clamp;
  EXPECT_THAT(surface_fault(clamped), HasSubstr("wrap=repeat"));
}

/// A config whose only scene has this surface; read as if it lay in the folder.
Config config_on_surface(const TempFolder& folder, const std::string& surface) {
  return parse_config(fmt::format(R"({{"scenes": {{"heightmap": "constant", "views": "top", "surface": {}}},
                                      "sweeps": {{"technique": "flat"}}}})",
                                  surface),
                      folder / "config.json");
}

constexpr const char* kSquareObj =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
    "f 1/1 2/2 3/3 4/4\n";

TEST(MeshSurface, is_named_or_a_file_and_is_its_content) {
  const TempFolder folder;
  const auto surface = [&](const std::string& json) {
    return config_on_surface(folder, json).scenes.at(0).scene.surface;
  };
  EXPECT_EQ(surface(R"("mesh")"), surface(R"({"kind": "mesh", "mesh": "teapot", "segments": 8})"));
  EXPECT_EQ(config_on_surface(folder, R"("mesh")").scenes.at(0).id, "constant/top_mesh_teapot");
  EXPECT_NE(surface(R"("mesh")").sha256, surface(R"({"kind": "mesh", "segments": 4})").sha256);
  std::ofstream(folder / "a b.obj") << kSquareObj;
  std::ofstream(folder / "copy.obj") << "# the same\n" << kSquareObj;
  const Config config = config_on_surface(folder, R"({"kind": "mesh", "mesh": "a b.obj"})");
  const SceneSpec& spec = config.scenes.at(0);
  EXPECT_EQ(spec.id, "constant/top_mesh_a_b");
  EXPECT_EQ(surface_text(spec.scene.surface), "mesh a b.obj");
  Scene copy = spec.scene;
  copy.surface = surface(R"({"kind": "mesh", "mesh": "copy.obj"})");
  EXPECT_EQ(scene_key("", copy), scene_key("", spec.scene));
  Scene other = spec.scene;
  other.surface = surface(R"("mesh")");
  EXPECT_NE(scene_key("", other), scene_key("", spec.scene));

  const MeasuredScene measured = measured_scene(spec, Heightmaps().read(spec.heightmap));
  const MeasuredScene back = parse_scene(nlohmann::json::parse(scene_json(measured).dump()));
  EXPECT_EQ(back.spec.scene.surface, spec.scene.surface);
  EXPECT_EQ(back.key, measured.key);

  // It is what it was when it was read, or nothing.
  EXPECT_EQ(load_mesh(spec.scene.surface).triangles.size(), 2U);
  std::ofstream(folder / "a b.obj") << "v 0 0 1\n" << kSquareObj;
  EXPECT_THAT([&] { (void)load_mesh(spec.scene.surface); },
              ThrowsMessage<Error>(HasSubstr("a b.obj: the mesh is another one than when the scene was read")));
  EXPECT_THAT(difference_text(measured, measured_scene({.id = "x", .heightmap = spec.heightmap, .scene = other},
                                                       Heightmaps().read(spec.heightmap))),
              HasSubstr("surface mesh a b.obj"));
}

TEST(MeshSurface, that_is_wrong_is_said_in_a_line) {
  const TempFolder folder;
  const auto refused = [&](const std::string& surface, const std::string& words) {
    EXPECT_THAT([&] { (void)config_on_surface(folder, surface); }, ThrowsMessage<Error>(HasSubstr(words))) << surface;
  };
  refused(R"({"kind": "mesh", "mesh": "teapt"})", "did you mean 'teapot'");
  refused(R"({"kind": "mesh", "mesh": "gone.obj"})", "there is no file");
  refused(R"({"kind": "mesh", "segments": 65})", "segments");
  refused(R"({"kind": "mesh", "round": 3})", "a mesh has none");
  refused(R"({"kind": "sphere", "mesh": "teapot"})", "a sphere has none");
  refused(R"({"kind": "sphere", "segments": 3})", "a sphere has none");
  std::ofstream(folder / "square.obj") << kSquareObj;
  refused(R"({"kind": "mesh", "mesh": "square.obj", "segments": 3})", "an OBJ file has its own");
  std::ofstream(folder / "broken.obj") << "v 0 0\n";
  refused(R"({"kind": "mesh", "mesh": "broken.obj"})", "broken.obj:1: expected");
  std::ofstream(folder / "bare.obj") << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  refused(R"({"kind": "mesh", "mesh": "bare.obj"})", "bare.obj:4: expected a corner v/vt");
  std::ofstream(folder / "point.obj") << "v 0 0 0\nvt 0 0\nf 1/1 1/1 1/1\n";
  refused(R"({"kind": "mesh", "mesh": "point.obj"})", "point.obj: no triangle of the mesh has an area");
}

TEST(MeshTexelsTest, hold_three_corners_a_triangle) {
  const Mesh mesh = scene_mesh("torus", 8);
  const MeshTexels image = mesh_texels(mesh);
  EXPECT_EQ(image.width, 1 << kMeshTexelsBits);
  ASSERT_EQ(image.rgba.size(), 4UL * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
  for (const std::size_t triangle : {std::size_t{0}, mesh.triangles.size() - 1}) {
    const MeshVertex& vertex = mesh.vertices[mesh.triangles[triangle][2]];
    const float* const texel = &image.rgba[4 * kMeshTexels * (3 * triangle + 2)];
    EXPECT_EQ(texel[0], static_cast<float>(vertex.position.x()));
    EXPECT_EQ(texel[3], static_cast<float>(vertex.uv.x()));
    EXPECT_EQ(texel[16], static_cast<float>(vertex.curvature.z()));
  }
  for (const MeshRow& row : named_meshes()) {
    EXPECT_LE(row.make(kMostSegments).triangles.size(), kMostTriangles) << row.id;
    double reach = 0;
    for (const MeshVertex& vertex : scene_mesh(std::string(row.id), 2).vertices)
      reach = std::max(reach, (vertex.position - Eigen::Vector3d(0.5, 0.5, 0)).norm());
    EXPECT_NEAR(reach, kMeshRadius, 1e-12) << row.id;
  }
}

}  // namespace
}  // namespace reliefbench
