#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "kernels/base/parallel.h"
#include "kernels/maps/cone_bounds.h"
#include "kernels/maps/cone_search.h"
#include "kernels/maps/verify_cones.h"

namespace reliefbench {
namespace {

constexpr double kProofGuard = 1 + 0x1p-40;  // over the rounding of an interpolation in double
constexpr double kInfinity = std::numeric_limits<double>::infinity();

double in_tile(double uv) { return uv - std::floor(uv); }

enum class CellState : std::uint8_t { undecided, proved, broken };

/// All cells of a map, examined on one finer grid after the other.
class CellProof {
 public:
  explicit CellProof(const ConservativeCones& request)
      : cones_(request.cones),
        wedge_(request.wedge),
        threads_(request.threads),
        greatest_(cones_.greatest()),
        states_(static_cast<std::size_t>(cones_.cells_x()) * static_cast<std::size_t>(cones_.cells_y())) {}

  void examine(Subdivision by) {
    by_ = by;
    const BoundRequest request{.heights = cones_.heights(),
                               .wrap = cones_.wrap(),
                               .by = by,
                               .max_ratio = greatest_,
                               .wedge = wedge_,
                               .threads = threads_};
    FineRatios lower = lower_cone_bounds(request);
    if (!lower_.ratios.empty()) keep_coarser(lower, lower_);
    lower_ = std::move(lower);
    for_each_open_cell([&](int x, int y, CellState& state) {
      if (is_proved(x, y)) state = CellState::proved;
    });
    if (count(CellState::proved) == static_cast<std::int64_t>(states_.size())) return;
    const FineRatios upper = upper_cone_bounds(request);
    std::vector<WorstCone> worst(static_cast<std::size_t>(cones_.cells_y()));
    for_each_open_cell([&](int x, int y, CellState& state) {
      if (is_broken(x, y, upper, worst[static_cast<std::size_t>(y)])) state = CellState::broken;
    });
    for (const WorstCone& of_row : worst) keep_worse(worst_, of_row);
  }

  [[nodiscard]] std::int64_t count(CellState state) const { return std::count(states_.begin(), states_.end(), state); }
  [[nodiscard]] const WorstCone& worst() const { return worst_; }

 private:
  template <typename Body>
  void for_each_open_cell(const Body& body) {
    parallel_for(cones_.cells_y(), threads_, [&](int y) {
      for (int x = 0; x < cones_.cells_x(); ++x) {
        CellState& state = states_[static_cast<std::size_t>(y) * static_cast<std::size_t>(cones_.cells_x()) +
                                   static_cast<std::size_t>(x)];
        if (state != CellState::proved) body(x, y, state);
      }
    });
  }

  [[nodiscard]] bool is_proved(int x, int y) const {
    const StoredCones::Cell cell = cones_.cell(x, y);
    for (int j = 0; j < by_.y; ++j) {
      for (int i = 0; i < by_.x; ++i) {
        const StoredCones::Box box{.fx0 = static_cast<double>(i) / by_.x,
                                   .fy0 = static_cast<double>(j) / by_.y,
                                   .fx1 = static_cast<double>(i + 1) / by_.x,
                                   .fy1 = static_cast<double>(j + 1) / by_.y};
        if (cones_.widest(cell, box) * kProofGuard > lower_.at(x * by_.x + i, y * by_.y + j)) return false;
      }
    }
    return true;
  }

  bool is_broken(int x, int y, const FineRatios& upper, WorstCone& worst) const {
    const StoredCones::Cell cell = cones_.cell(x, y);
    bool broken = false;
    for (int j = 0; j <= by_.y; ++j) {
      for (int i = 0; i <= by_.x; ++i) {
        const double fx = static_cast<double>(i) / by_.x;
        const double fy = static_cast<double>(j) / by_.y;
        const double of_point = upper.at(wrapped(x * by_.x + i, upper.width, cones_.wrap()),
                                         wrapped(y * by_.y + j, upper.height, cones_.wrap()));
        const double bound = std::min(of_point, slope_bound(cell, fx, fy));
        const double ratio = cones_.ratio(cell, fx, fy);
        if (ratio * kWitnessGuard <= bound) continue;
        broken = true;
        keep_worse(worst, {.factor = ratio / bound,
                           .u = in_tile((x + fx + 0.5) / cones_.heights().width),
                           .v = in_tile((y + fy + 0.5) / cones_.heights().height)});
      }
    }
    return broken;
  }

  /// Points uphill and ever nearer bound the ratio by 1/|grad H|, where uphill stays in the cell.
  [[nodiscard]] double slope_bound(const StoredCones::Cell& cell, double fx, double fy) const {
    const auto [h00, h10, h01, h11] = cell.heights;
    const double along_x = cones_.heights().width * ((h10 - h00) * (1 - fy) + (h11 - h01) * fy);
    const double along_y = cones_.heights().height * ((h01 - h00) * (1 - fx) + (h11 - h10) * fx);
    const auto leaves = [](double along, double f) { return (along < 0 && f == 0) || (along > 0 && f == 1); };
    if (leaves(along_x, fx) || leaves(along_y, fy)) return kInfinity;
    if (wedge_ && !has_direction(*wedge_, along_x, along_y)) return kInfinity;
    return 1 / std::hypot(along_x, along_y);
  }

  const StoredCones& cones_;
  std::optional<Wedge> wedge_;
  int threads_;
  float greatest_;
  Subdivision by_{};
  FineRatios lower_;  ///< proved on this grid and the coarser ones before
  std::vector<CellState> states_;
  WorstCone worst_{};
};

}  // namespace

bool has_direction(const Wedge& wedge, double u, double v) {
  constexpr double kGuard = 1e-9;
  const double length = std::hypot(u, v);
  return std::ranges::all_of(wedge.normals, [&](const ConeView::Normal& n) {
    return n.x * u + n.y * v >= kGuard * std::hypot(n.x, n.y) * length;
  });
}

void keep_worse(WorstCone& worst, const WorstCone& other) {
  if (other.factor > worst.factor) worst = other;
}

void TexelVerdict::add(const TexelVerdict& other) {
  too_wide += other.too_wide;
  keep_worse(worst, other.worst);
}

TexelVerdict verify_conservative_texels(const ConservativeCones& request) {
  const StoredCones& cones = request.cones;
  const Heightfield& heights = cones.heights();
  std::vector<ConeView> views;
  if (request.wedge) views = {wedge_view(heights, heights.width, heights.height, *request.wedge, 0)};
  const std::vector<float> exact = search_cones({.heights = heights,
                                                 .wrap = cones.wrap(),
                                                 .metric = cone_metric(heights.width, heights.height, Correction::none),
                                                 .max_ratio = cones.greatest(),
                                                 .views = views,
                                                 .threads = request.threads});
  TexelVerdict verdict;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    // `exact` is rounded down to float: a float above it is above the ratio itself.
    const float ratio = cones.at_texels()[i];
    if (ratio <= exact[i]) continue;
    const auto width = static_cast<std::size_t>(heights.width);
    const std::size_t row = i / width;
    verdict.add({.too_wide = 1,
                 .worst = {.factor = double{ratio} / exact[i],
                           .u = (static_cast<double>(i % width) + 0.5) / heights.width,
                           .v = (static_cast<double>(row) + 0.5) / heights.height}});
  }
  return verdict;
}

CellVerdict verify_cells(const ConservativeCones& request, int finest) {
  const Heightfield& heights = request.cones.heights();
  CellProof proof(request);
  CellVerdict verdict;
  for (int k = 1; k <= finest; k *= 2) {
    const Subdivision by = subdivision(heights.width, heights.height, k);
    if (!is_affordable(heights.width, heights.height, by)) break;
    proof.examine(by);
    verdict.finest = k;
    if (proof.count(CellState::undecided) == 0) break;
  }
  verdict.proved = proof.count(CellState::proved);
  verdict.broken = proof.count(CellState::broken);
  verdict.undecided = proof.count(CellState::undecided);
  verdict.cells = verdict.proved + verdict.broken + verdict.undecided;
  verdict.worst = proof.worst();
  return verdict;
}

}  // namespace reliefbench
