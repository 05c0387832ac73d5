// Pyramids and distance volumes, against slow versions and the surface itself.
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include "kernels/base/error.h"
#include "kernels/maps/distance_map.h"
#include "kernels/maps/map_texture.h"
#include "kernels/maps/pyramid_map.h"
#include "tests/cone_test_maps.h"
#include "tests/slow_cone_map.h"
#include "tests/slow_pyramid.h"

namespace reliefbench {
namespace {

using ::testing::HasSubstr;

Heightfield any_map(int max_side) {
  const int width = *rc::gen::inRange(2, max_side + 1);
  const int height = *rc::gen::inRange(2, max_side + 1);
  const auto count = static_cast<std::size_t>(width * height);
  const auto steps = *rc::gen::container<std::vector<int>>(count, rc::gen::inRange(0, 256));
  Heightfield map{.width = width, .height = height, .texels = {}};
  for (const int step : steps) map.texels.push_back(static_cast<float>(step) / 255.0F);
  return map;
}
Wrap any_wrap() { return *rc::gen::element(Wrap::repeat, Wrap::clamp); }
double any_fraction() { return *rc::gen::inRange(0, 1025) / 1024.0; }

/// One level of a baked pyramid.
std::vector<float> level_of(const std::vector<float>& values, const Heightfield& map, int level) {
  auto begin = values.begin();
  const auto nodes = [&](int n) { return level_side(map.width, n) * level_side(map.height, n); };
  for (int n = 0; n < level; ++n) begin += nodes(n);
  return {begin, begin + nodes(level)};
}

int level_count(const Heightfield& map) {
  int levels = 1;
  while ((std::max(map.width, map.height) >> levels) > 0) ++levels;
  return levels;
}

void expect_levels(const std::vector<float>& values, const std::vector<float>& level_0, const Heightfield& map) {
  std::size_t nodes = 0;
  for (int level = 0; level < level_count(map); ++level) {
    const std::vector<float> slow = slow_level(level_0, map.width, map.height, level);
    RC_ASSERT(level_of(values, map, level) == slow);
    nodes += slow.size();
  }
  RC_ASSERT(values.size() == nodes);
}

RC_GTEST_PROP(Quadtree, every_level_is_the_maximum_of_all_its_texels, ()) {
  const Heightfield map = any_map(19);
  expect_levels(bake_quadtree({.heights = map, .wrap = any_wrap()}), map.texels, map);
}

RC_GTEST_PROP(MaxMip, every_level_is_the_maximum_of_all_its_cells, ()) {
  const Heightfield map = any_map(19);
  const Wrap wrap = any_wrap();
  std::vector<float> cells;
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      float cell = 0;
      for (const int j : {y, wrapped(y + 1, map.height, wrap)})
        for (const int i : {x, wrapped(x + 1, map.width, wrap)}) cell = std::max(cell, map.at(i, j));
      cells.push_back(cell);
    }
  }
  expect_levels(bake_max_mip({.heights = map, .wrap = wrap}), cells, map);
}

// Any point of the surface, the half cells of a clamped border included, is at most as high as its nodes.
RC_GTEST_PROP(MaxMip, no_point_of_the_surface_is_above_a_node_over_it, ()) {
  const Heightfield map = any_map(9);
  const Wrap wrap = any_wrap();
  const std::vector<float> values = bake_max_mip({.heights = map, .wrap = wrap});
  for (int i = 0; i < 32; ++i) {
    const double x = any_fraction() * map.width - 0.5;
    const double y = any_fraction() * map.height - 0.5;
    const int cell_x = wrapped(static_cast<int>(std::floor(x)), map.width, wrap);
    const int cell_y = wrapped(static_cast<int>(std::floor(y)), map.height, wrap);
    for (int level = 0; level < level_count(map); ++level) {
      const int node =
          slow_node(cell_y, map.height, level) * level_side(map.width, level) + slow_node(cell_x, map.width, level);
      const double highest = level_of(values, map, level).at(static_cast<std::size_t>(node));
      RC_ASSERT(slow_surface(map, wrap, x, y) <= highest + 1e-7);
    }
  }
}

TEST(MaxMip, a_spike_in_the_last_row_and_column_of_an_odd_map_reaches_the_top) {
  for (const auto& [width, height] : {std::pair{7, 5}, {2, 3}, {33, 3}, {3, 17}}) {
    Heightfield map = make_map(width, height, [](int, int) { return 0.25F; });
    map.texels.back() = 1;
    for (const MapKind kind : {MapKind::max_mip, MapKind::quadtree})
      EXPECT_EQ(find_map(kind).bake({.heights = map}).back(), 1.0F) << width << "x" << height;
  }
}

RC_GTEST_PROP(MaxMip, the_texture_holds_the_maxima_exactly, ()) {
  const Heightfield raw = any_map(9);
  for (const std::string_view id : {"r8", "r16", "r16f", "r32f"}) {
    const Format& format = find_format(id);
    const Heightfield map = quantise_heights(raw, format.type);
    const std::vector<float> values = bake_max_mip({.heights = map});
    const MapTextures textures =
        pack_map({.map = find_map(MapKind::max_mip), .heights = map, .values = values}, format, find_encoding("ratio"));
    RC_ASSERT(textures.extra.has_value());
    RC_ASSERT(textures.extra->levels == level_count(map));
    for (int level = 0; level < level_count(map); ++level)
      RC_ASSERT(read_channel(*textures.extra, 0, level) == level_of(values, map, level));
  }
}

RC_GTEST_PROP(Distance, equals_the_slow_version_and_is_never_above_it, ()) {
  const Heightfield map = any_map(7);
  const Wrap wrap = any_wrap();
  const int slices = *rc::gen::inRange(4, 9);
  const std::vector<float> values =
      bake_distance({.heights = map, .wrap = wrap, .parameters = {{kDistanceSlices.id, slices}}, .threads = 1});
  const std::vector<double> slow = slow_distance(map, wrap, slices);
  RC_ASSERT(values.size() == slow.size());
  for (std::size_t i = 0; i < slow.size(); ++i) {
    RC_ASSERT(static_cast<double>(values[i]) <= slow[i]);
    RC_ASSERT(static_cast<double>(values[i]) >= slow[i] * (1 - 0x1p-19) - 1e-7);
  }
}

TEST(Distance, equals_the_slow_version_on_maps_of_all_kinds) {
  for (const ConeTestMap& row : kConeTestMaps) {
    const Heightfield map = row.make(24, 15);
    for (const Wrap wrap : {Wrap::repeat, Wrap::clamp}) {
      const std::vector<float> values =
          bake_distance({.heights = map, .wrap = wrap, .parameters = {{kDistanceSlices.id, 8}}});
      const std::vector<double> slow = slow_distance(map, wrap, 8);
      for (std::size_t i = 0; i < slow.size(); ++i) {
        ASSERT_LE(static_cast<double>(values[i]), slow[i]) << row.id;
        ASSERT_NEAR(values[i], slow[i], 2e-6) << row.id;
      }
    }
  }
}

// The promise itself: from any point of a voxel, under clamp of the space beyond it too, to any point of the solid.
RC_GTEST_PROP(Distance, no_point_of_the_solid_is_nearer_than_the_value, ()) {
  const Heightfield map = any_map(6);
  const Wrap wrap = any_wrap();
  const int slices = *rc::gen::inRange(4, 9);
  const std::vector<float> values =
      bake_distance({.heights = map, .wrap = wrap, .parameters = {{kDistanceSlices.id, slices}}, .threads = 1});
  for (int i = 0; i < 64; ++i) {
    const double u = any_fraction() * 3 - 1;
    const double v = any_fraction() * 3 - 1;
    const double z = any_fraction();
    const int x = wrapped(static_cast<int>(std::floor(u * map.width)), map.width, wrap);
    const int y = wrapped(static_cast<int>(std::floor(v * map.height)), map.height, wrap);
    const int slice = std::min(static_cast<int>(z * slices), slices - 1);
    const double value = values.at(static_cast<std::size_t>((slice * map.height + y) * map.width + x));
    for (int j = 0; j < 16; ++j) {
      const double to_u = u + (any_fraction() * 2 - 1) * value / kTileSide;
      const double to_v = v + (any_fraction() * 2 - 1) * value / kTileSide;
      const double surface = slow_surface(map, wrap, to_u * map.width - 0.5, to_v * map.height - 0.5);
      RC_ASSERT(std::hypot(kTileSide * (to_u - u), kTileSide * (to_v - v), std::max(z - surface, 0.0)) >=
                value - 1e-12);
    }
  }
}

TEST(Distance, grows_by_the_height_over_a_plane) {
  const Heightfield map = constant_map(6, 4);  // at 1/2
  const std::vector<float> values = bake_distance({.heights = map, .parameters = {{kDistanceSlices.id, 8}}});
  for (std::size_t slice = 0; slice < 8; ++slice) {
    const double expected = std::max(static_cast<double>(slice) / 8 - 0.5, 0.0);
    for (std::size_t i = 0; i < 24; ++i) EXPECT_NEAR(values[slice * 24 + i], expected, 1e-6);
  }
}

TEST(Distance, is_the_same_on_any_number_of_threads) {
  const Heightfield map = noise_map(17, 12);
  EXPECT_EQ(bake_distance({.heights = map, .threads = 1}), bake_distance({.heights = map, .threads = 2}));
}

RC_GTEST_PROP(Distance, the_texture_rounds_down_by_less_than_one_code, ()) {
  const Heightfield map = any_map(6);
  const int slices = *rc::gen::inRange(4, 13);
  const std::vector<float> values =
      bake_distance({.heights = map, .parameters = {{kDistanceSlices.id, slices}}, .threads = 1});
  const VolumeAtlas atlas(slices, map.width, map.height);
  for (const std::string_view id : {"r8", "r16", "r16f", "r32f"}) {
    const Format& format = find_format(id);
    const MapTextures textures = pack_map({.map = find_map(MapKind::distance), .heights = map, .values = values},
                                          format, find_encoding("ratio"));
    RC_ASSERT(textures.extra.has_value());
    RC_ASSERT(textures.extra->width == atlas.columns * map.width);
    RC_ASSERT(textures.extra->height == atlas.rows * map.height);
    const std::vector<float> stored = read_channel(*textures.extra, 0);
    std::size_t i = 0;
    for (int slice = 0; slice < slices; ++slice)
      for (int y = 0; y < map.height; ++y)
        for (int x = 0; x < map.width; ++x, ++i) {
          const int row = slice / atlas.columns * map.height + y;
          const int column = slice % atlas.columns * map.width + x;
          const float value = stored.at(static_cast<std::size_t>(row * textures.extra->width + column));
          RC_ASSERT(value <= values[i]);
          RC_ASSERT(value_of(nearest_code(value, format.type) + 1, format.type) > values[i]);
        }
    RC_ASSERT(i == values.size());
  }
}

std::string bake_refusal(const BakeRequest& request, MapKind kind) {
  try {
    static_cast<void>(find_map(kind).bake(request));
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Exit::bad_input);
    return error.what();
  }
  return "no error";
}

TEST(Distance, volumes_that_no_texture_holds_are_refused) {
  EXPECT_THAT(
      bake_refusal({.heights = constant_map(8193, 65), .parameters = {{kDistanceSlices.id, 256}}}, MapKind::distance),
      HasSubstr("256 slices of 8193x65 texels do not lie in one texture of at most 16384 a side"));
  const Heightfield map = constant_map(5000, 2);
  EXPECT_THAT(bake_refusal({.heights = map, .parameters = {{kDistanceSlices.id, 3}}}, MapKind::distance),
              HasSubstr("expected 4 to 256"));
  EXPECT_THAT(bake_refusal({.heights = map, .parameters = {{kDistanceSlices.id, 257}}}, MapKind::distance),
              HasSubstr("expected 4 to 256"));
  EXPECT_EQ(bake_distance({.heights = map, .parameters = {{kDistanceSlices.id, 9}}}).size(), 9U * 10000);
}

TEST(Distance, slices_lie_in_the_smallest_grid_that_a_texture_holds) {
  struct Row {
    int slices, width, height, columns, rows;
  };
  for (const Row& row :
       {Row{32, 256, 256, 4, 8}, Row{64, 512, 512, 8, 8}, Row{256, 512, 512, 16, 16}, Row{64, 2048, 2048, 8, 8},
        Row{7, 16, 16, 1, 7}, Row{6, 10, 20, 3, 2}, Row{5, 4096, 4096, 2, 3}, Row{251, 1024, 1024, 16, 16},
        Row{8, 5000, 8000, 0, 0}, Row{4, 16384, 16384, 0, 0}}) {
    const VolumeAtlas atlas(row.slices, row.width, row.height);
    EXPECT_EQ(atlas.columns, row.columns) << row.slices << " of " << row.width;
    EXPECT_EQ(atlas.rows, row.rows) << row.slices << " of " << row.width;
  }
}

TEST(MaxMip, maps_under_two_texels_are_refused) {
  const Heightfield map = constant_map(1, 4);
  for (const MapKind kind : {MapKind::max_mip, MapKind::quadtree, MapKind::distance})
    EXPECT_THAT(bake_refusal({.heights = map}, kind), HasSubstr("at least 2 x 2"));
}

}  // namespace
}  // namespace reliefbench
