#pragma once
#include <deque>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "backends/backend.h"
#include "backends/gpu_bake_buffer.h"
#include "backends/gpu_bake_pack.h"
#include "backends/gpu_bake_wedge.h"

namespace reliefbench {

/// The shaders that bakers share.
inline constexpr std::string_view kWedgeShader = "bake_wedge";
inline constexpr std::string_view kWalkShader = "bake_relaxed_po07";
inline constexpr std::string_view kWalkPacketsShader = "bake_relaxed_po07_packets";
inline constexpr std::string_view kPyramidShader = "bake_pyramid";
inline constexpr std::string_view kCornersShader = "bake_corners";
inline constexpr std::string_view kMeanShader = "bake_mean";
inline constexpr std::string_view kMinimumShader = "bake_min3x3";
inline constexpr std::string_view kShapesShader = "bake_shapes";
inline constexpr std::string_view kRadiusShader = "bake_radius";
inline constexpr std::string_view kSafetyShapeShader = "bake_safety_shape";
inline constexpr std::string_view kLevelsShader = "bake_levels";
inline constexpr std::string_view kDoubleConeShader = "bake_double_cone";
inline constexpr std::string_view kPackShader = "bake_pack";
inline constexpr std::string_view kRefineShader = "bake_refine";
inline constexpr std::string_view kBoundsShader = "bake_bounds";
inline constexpr std::string_view kLimitsShader = "bake_limits";
inline constexpr std::string_view kRaiseShader = "bake_raise";

/// Storage buffers of each shader.
[[nodiscard]] int buffers_of(std::string_view shader);

/// The passes of a bake as they are added, and the buffers between them.
class BakePasses {
 public:
  using Pipelines = std::map<std::string, std::unique_ptr<Pipeline>>;

  struct Fit {
    BakeDevice device;
    bool sees_pairs = false;  ///< MapRow::sees_pairs
    int patience = 1;         ///< that many times as many passes for a search that goes on
  };
  BakePasses(const Pipelines& pipelines, const BakeRequest& request, const Fit& fit);

  // Each returns the buffer of the ratios that it makes.

  int add_search(const BakeSearch& search) { return add_search(own_, search); }
  /// cell_cones
  int add_cells(const BakeSearch& search);
  int add_mean(int first, int second);
  int add_minimum(int ratios);
  /// As the request's correction leaves them.
  int add_corrected(int ratios);
  /// Cones over the tops and under the floors, corrected.
  int add_double_cone(const BakeSearch& search);
  /// A mip chain; of a solid one of tops, then one of floors.
  int add_chain(bool is_of_cells);
  /// certified_cones. request: of the correction `safe`, as its searches are
  int add_certified(const BakeSearch& search);
  /// Radii, as their own minimum leaves them.
  int add_radii();
  int add_safety_shape(int ratios, int radii);
  /// returns: the buffer of all textures
  int add_packed(int values, const PackPlan& plan);

  /// The whole, for what is in one of its buffers. The passes' contents live as long as this.
  [[nodiscard]] ComputeJob job(int result) const;

 private:
  struct Grid {
    BakeGrid grid;
    BakeLevels levels;
    int heights;   ///< a buffer
    int head = 0;  ///< of any search on it: all know its size, wrap and correction
  };

  /// Tops and, of a solid, floors.
  std::span<const std::byte> surfaces(const Heightfield& heights);
  int add_search(Grid& grid, const BakeSearch& search);
  /// wedges: of the layers; none: all directions have one cone. metric: by which correction distances count
  int add_search(Grid& grid, const BakeSearch& search, const std::vector<BakeWedge>& wedges, Correction metric);
  /// metric: by which correction distances count
  int add_head(const Grid& grid, const BakeSearch& search, Correction metric);
  void add_search_pass(const BakeGrid& grid, const BakeSearch& search, std::vector<int> buffers);
  void add_walks(const BakeGrid& grid, const BakeSearch& search, std::vector<int> buffers);
  /// heights: none: a pass makes them; there may be more than the grid has points
  Grid make_grid(const BakeGrid& grid, std::span<const std::byte> heights);
  [[nodiscard]] bool may_be_long(const BakeGrid& grid) const;
  /// Over all points of the grid, in each layer.
  ComputePass& add_pass(const BakeGrid& grid, std::string_view part, std::string_view shader, std::vector<int> buffers);
  int add_buffer(std::size_t bytes);
  int add_buffer(std::vector<std::byte> contents);
  int add_ratios(const BakeGrid& grid);
  [[nodiscard]] const Pipeline* pipeline(std::string_view shader) const {
    return pipelines_.at(std::string(shader)).get();
  }

  const Pipelines& pipelines_;
  const BakeRequest& request_;
  Fit fit_;
  ComputeJob job_;
  std::deque<std::vector<std::byte>> contents_;
  int layers_ = 1;
  Grid own_;
};

}  // namespace reliefbench
