#include "kernels/trace/mesh_tracer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace reliefbench {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kFar = std::numeric_limits<double>::infinity();
constexpr int kLeastLevels = 4;  ///< for the bend of a triangle's normals, however little of the map is on it
constexpr std::uint32_t kTrianglesALeaf = 4;
constexpr double kSlack = 1e-12;  ///< of bounds, relative: more than rounding takes

std::int64_t cell_of(double texel) { return static_cast<std::int64_t>(std::floor(std::clamp(texel, -1e12, 1e12))); }

}  // namespace

MeshTracer::MeshTracer(const ReferenceTracer& heights, const Mesh& mesh, const MeshRelief& relief, double share)
    : heights_(heights),
      mesh_(mesh),
      relief_(relief),
      texels_(relief.tiling * heights.width(), relief.tiling * heights.height()) {
  double longest = 0;
  for (const auto& triangle : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const Vector2d edge = mesh.vertices[triangle.at(i)].uv - mesh.vertices[triangle.at((i + 1) % 3)].uv;
      longest = std::max(longest, edge.cwiseProduct(texels_).norm());
    }
  while (levels_ < kMostLevels && (levels_ < kLeastLevels || std::ldexp(longest, -levels_) > share)) ++levels_;
  share_ = std::ldexp(longest, -levels_);

  // Boxes of the triangles with all that their relief may be.
  const double deepest = relief.depth * (1 - heights.height_range().min);
  std::vector<Node> boxes;
  boxes.reserve(mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) {
    Node box{.low = Vector3d::Constant(kFar), .high = Vector3d::Constant(-kFar)};
    for (const std::uint32_t corner : triangle) {
      const Vector3d& p = mesh.vertices[corner].position;
      box.low = box.low.cwiseMin(p);
      box.high = box.high.cwiseMax(p);
    }
    box.low.array() -= deepest * (1 + kSlack);
    box.high.array() += deepest * (1 + kSlack);
    boxes.push_back(box);
  }
  order_.resize(boxes.size());
  std::iota(order_.begin(), order_.end(), 0U);
  if (!boxes.empty()) build(0, static_cast<std::uint32_t>(order_.size()), boxes);
}

/// The node of these triangles, halved at the median along its longest side, and all below it.
void MeshTracer::build(std::uint32_t first, std::uint32_t count, std::vector<Node>& boxes) {
  Node node{.low = Vector3d::Constant(kFar), .high = Vector3d::Constant(-kFar), .first = first, .count = count};
  for (std::uint32_t i = first; i < first + count; ++i) {
    node.low = node.low.cwiseMin(boxes[order_[i]].low);
    node.high = node.high.cwiseMax(boxes[order_[i]].high);
  }
  const std::size_t place = nodes_.size();
  nodes_.push_back(node);
  if (count <= kTrianglesALeaf) return;
  Eigen::Index axis = 0;
  (node.high - node.low).maxCoeff(&axis);
  const std::uint32_t half = count / 2;
  const auto begin = order_.begin() + first;
  std::nth_element(begin, begin + half, begin + count, [&](std::uint32_t a, std::uint32_t b) {
    return boxes[a].low(axis) + boxes[a].high(axis) < boxes[b].low(axis) + boxes[b].high(axis);
  });
  build(first, half, boxes);
  nodes_[place].count = 0;
  nodes_[place].first = static_cast<std::uint32_t>(nodes_.size());
  build(first + half, count - half, boxes);
}

/// x, y: in texels, centres at whole numbers
double MeshTracer::height_at(double x, double y) const {
  const double fx = x - std::floor(x);
  const double fy = y - std::floor(y);
  const auto h = heights_.corners(cell_of(x), cell_of(y));
  return (h.h00 * (1 - fx) + h.h10 * fx) * (1 - fy) + (h.h01 * (1 - fx) + h.h11 * fx) * fy;
}

/// Of the surface over a rectangle: within a cell a bilinear one is least and greatest at corners.
ReferenceTracer::HeightRange MeshTracer::range_over(double x0, double x1, double y0, double y1) const {
  const double left = std::floor(x0);
  const double low = std::floor(y0);
  if (x1 > left + 2 || y1 > low + 2) return heights_.height_range(cell_of(x0), cell_of(y0), cell_of(x1), cell_of(y1));
  const std::array xs{x0, std::min(left + 1, x1), x1};
  const std::array ys{y0, std::min(low + 1, y1), y1};
  ReferenceTracer::HeightRange range{1, 0};
  for (const double y : ys)
    for (const double x : xs) {
      const double h = height_at(x, y);
      range = {std::min(range.min, h), std::max(range.max, h)};
    }
  return range;
}

/// One line's way through a mesh. Positions are seen along the line: x and y across it, z along it, from its start.
class MeshTracer::Query {
 public:
  Query(const MeshTracer& tracer, const MeshLine& line, Side side, double from, double to)
      : tracer_(tracer), line_(line), side_(side), from_(from), to_(to) {
    const Vector3d across = line.direction.unitOrthogonal();
    turn_.row(0) = across;
    turn_.row(1) = line.direction.cross(across);
    turn_.row(2) = line.direction;
    inverse_ = line.direction.cwiseInverse();
  }

  template <bool kDisplaced>
  [[nodiscard]] std::optional<MeshHit> find() {
    if (tracer_.nodes_.empty()) return std::nullopt;
    std::array<std::uint32_t, 64> open{};
    std::size_t count = 1;
    while (count > 0) {
      const std::uint32_t at = open.at(--count);
      const Node& node = tracer_.nodes_[at];
      if (entry_of(node) == kFar) continue;
      if (node.count == 0) {
        // The nearer child is looked at first.
        const bool swaps = entry_of(tracer_.nodes_[node.first]) < entry_of(tracer_.nodes_[at + 1]);
        open.at(count++) = swaps ? at + 1 : node.first;
        open.at(count++) = swaps ? node.first : at + 1;
        continue;
      }
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) look_at<kDisplaced>(tracer_.order_[i]);
    }
    return found_;
  }

 private:
  /// A corner of a part: linear numbers of its triangle.
  struct Corner {
    Vector3d position;
    Vector3d normal;
    Vector2d texel;
    Vector3d weights;
  };
  using Part = std::array<Corner, 3>;

  /// Where the line comes into a node's box; kFar: it does not, from `from` to `to`.
  [[nodiscard]] double entry_of(const Node& node) const {
    double begin = from_;
    double end = to_;
    for (Eigen::Index i = 0; i < 3; ++i) {
      if (line_.direction(i) == 0) {
        if (line_.from(i) < node.low(i) || line_.from(i) > node.high(i)) return kFar;
        continue;
      }
      const double a = (node.low(i) - line_.from(i)) * inverse_(i);
      const double b = (node.high(i) - line_.from(i)) * inverse_(i);
      begin = std::max(begin, std::min(a, b));
      end = std::min(end, std::max(a, b));
    }
    if (begin <= end * (1 + kSlack) + kSlack) return begin;
    return kFar;
  }

  template <bool kDisplaced>
  void look_at(std::uint32_t triangle) {
    triangle_ = triangle;
    for (std::size_t i = 0; i < 3; ++i) {
      const MeshVertex& vertex = tracer_.mesh_.vertices[tracer_.mesh_.triangles[triangle].at(i)];
      base_.at(i) = {.position = turn_ * (vertex.position - line_.from),
                     .normal = turn_ * vertex.normal,
                     .texel = vertex.uv.cwiseProduct(tracer_.texels_).array() - 0.5,
                     .weights = Vector3d::Unit(static_cast<Eigen::Index>(i))};
    }
    if (kDisplaced)
      descend(0, {0, 0}, {1, 0}, {0, 1});
    else
      cross({base_[0].position, base_[1].position, base_[2].position}, base_);
  }

  /// A corner's second and third weight, in parts of 2^level.
  using Place = std::array<std::int64_t, 2>;
  /// Neighbouring parts and triangles make the same bits of it: sums of two and products by 0 are exact.
  [[nodiscard]] Corner corner(int level, const Place& place) const {
    const double unit = std::ldexp(1.0, -level);
    const double b = static_cast<double>(place[0]) * unit;
    const double c = static_cast<double>(place[1]) * unit;
    const double a = static_cast<double>((std::int64_t{1} << level) - place[0] - place[1]) * unit;
    return {.position = base_[0].position * a + base_[1].position * b + base_[2].position * c,
            .normal = base_[0].normal * a + base_[1].normal * b + base_[2].normal * c,
            .texel = base_[0].texel * a + base_[1].texel * b + base_[2].texel * c,
            .weights = {a, b, c}};
  }

  /// How far along the line a part's relief may begin; kFar: it is beside the line, or behind what was found.
  [[nodiscard]] double begin_of(const Part& part) const {
    Vector2d low = part[0].texel;
    Vector2d high = low;
    double longest = 0;
    double shortest = 1;
    const Vector3d middle = (part[0].normal + part[1].normal + part[2].normal) / 3;
    double spread = 0;
    for (const Corner& corner : part) {
      low = low.cwiseMin(corner.texel);
      high = high.cwiseMax(corner.texel);
      longest = std::max(longest, corner.normal.squaredNorm());
      spread = std::max(spread, (corner.normal - middle).squaredNorm());
    }
    // The normal is no shorter within the part than this.
    shortest = std::max(middle.norm() - std::sqrt(spread), 1e-3);
    longest = std::sqrt(longest);
    const auto range = tracer_.range_over(low.x(), high.x(), low.y(), high.y());
    const double depth = tracer_.relief_.depth;
    const double top = (range.max - 1) * depth / longest;
    const double bottom = (range.min - 1) * depth / shortest;
    // An octagonal prism round the six ends.
    using Bounds = Eigen::Array<double, 5, 1>;
    Bounds least = Bounds::Constant(kFar);
    Bounds most = Bounds::Constant(-kFar);
    for (const Corner& corner : part)
      for (const double s : {top, bottom}) {
        const Vector3d p = corner.position + s * corner.normal;
        const Bounds bounds{p.x(), p.y(), p.x() + p.y(), p.x() - p.y(), p.z()};
        least = least.min(bounds);
        most = most.max(bounds);
      }
    const double slack = kSlack * (1 + std::abs(most(4)));
    if ((least.head<4>() > slack).any() || (most.head<4>() < -slack).any()) return kFar;
    if (most(4) < from_ - slack || least(4) > to_ + slack) return kFar;
    return least(4);
  }

  void descend(int level, const Place& a, const Place& b, const Place& c) {
    const Part part{corner(level, a), corner(level, b), corner(level, c)};
    if (level == tracer_.levels_) {
      std::array<Vector3d, 3> points;
      for (std::size_t i = 0; i < 3; ++i) {
        const Corner& at = part.at(i);
        const double s = (tracer_.height_at(at.texel.x(), at.texel.y()) - 1) * tracer_.relief_.depth;
        const double length = at.normal.norm();
        points.at(i) = at.position + at.normal * (length > 0 ? s / length : 0);
      }
      cross(points, part);
      return;
    }
    // In four, by the middles of the edges.
    const auto twice = [](const Place& p) { return Place{2 * p[0], 2 * p[1]}; };
    const auto middle = [](const Place& p, const Place& q) { return Place{p[0] + q[0], p[1] + q[1]}; };
    const Place ab = middle(a, b);
    const Place bc = middle(b, c);
    const Place ca = middle(c, a);
    const std::array<std::array<Place, 3>, 4> quarters{
        {{twice(a), ab, ca}, {ab, twice(b), bc}, {ca, bc, twice(c)}, {bc, ca, ab}}};
    std::array<double, 4> begins{};
    for (std::size_t i = 0; i < 4; ++i) {
      const auto& [p, q, r] = quarters.at(i);
      begins.at(i) = begin_of({corner(level + 1, p), corner(level + 1, q), corner(level + 1, r)});
    }
    for (int round = 0; round < 4; ++round) {
      const auto nearest = static_cast<std::size_t>(std::ranges::min_element(begins) - begins.begin());
      if (begins.at(nearest) == kFar || begins.at(nearest) > to_) return;
      begins.at(nearest) = kFar;
      descend(level + 1, quarters.at(nearest)[0], quarters.at(nearest)[1], quarters.at(nearest)[2]);
    }
  }

  /// Whether the line meets a triangle from its side. Two that share an edge have the same number there but for its
  /// sign, so that it meets one of them.
  void cross(const std::array<Vector3d, 3>& p, const Part& part) {
    const auto edge = [&](std::size_t i, std::size_t j) {
      return p.at(i).x() * p.at(j).y() - p.at(j).x() * p.at(i).y();
    };
    // Seen along z, what is anticlockwise from outside runs the other way round.
    const double sign = side_ == Side::outside ? -1 : 1;
    const Vector3d at = sign * Vector3d(edge(1, 2), edge(2, 0), edge(0, 1));
    const double area = at.sum();
    if (at.minCoeff() < 0 || area <= 0) return;
    const Vector3d share = at / area;
    const double way = share[0] * p[0].z() + share[1] * p[1].z() + share[2] * p[2].z();
    if (way < from_ || way > to_) return;
    to_ = way;
    found_ = {.way = way,
              .triangle = triangle_,
              .weights = part[0].weights * share[0] + part[1].weights * share[1] + part[2].weights * share[2]};
  }

  const MeshTracer& tracer_;
  const MeshLine& line_;
  Side side_;
  double from_;
  double to_;
  Eigen::Matrix3d turn_;
  Vector3d inverse_;
  std::uint32_t triangle_ = 0;
  Part base_;
  std::optional<MeshHit> found_;
};

std::optional<MeshHit> MeshTracer::meet(const MeshLine& line, Side side, double from) const {
  return Query(*this, line, side, from, kFar).find<false>();
}

std::optional<MeshHit> MeshTracer::trace(const MeshLine& line, Side side, double from, double to) const {
  return Query(*this, line, side, from, to).find<true>();
}

MeshRay mesh_ray(const Mesh& mesh, const MeshRelief& relief, const MeshLine& line, const MeshHit& entry) {
  Vector3d normal = Vector3d::Zero();
  Vector3d u_gradient = Vector3d::Zero();
  Vector3d v_gradient = Vector3d::Zero();
  Vector3d curvature = Vector3d::Zero();
  Vector2d uv = Vector2d::Zero();
  for (std::size_t i = 0; i < 3; ++i) {
    const MeshVertex& vertex = mesh.vertices[mesh.triangles[entry.triangle].at(i)];
    const double weight = entry.weights(static_cast<Eigen::Index>(i));
    normal += weight * vertex.normal;
    u_gradient += weight * vertex.u_gradient;
    v_gradient += weight * vertex.v_gradient;
    curvature += weight * vertex.curvature;
    uv += weight * vertex.uv;
  }
  normal.stableNormalize();
  // One that looks away is turned until it does not, as far as it must.
  const double away = normal.dot(line.direction) + kLeastCosine;
  if (away > 0) normal = (normal - away * line.direction).stableNormalized();
  u_gradient -= normal * normal.dot(u_gradient);
  v_gradient -= normal * normal.dot(v_gradient);
  MeshRay ray{.uv = uv * relief.tiling, .slope = Vector2d::Zero()};
  ray.cosine = -normal.dot(line.direction);
  ray.per_t = relief.depth / ray.cosine;
  ray.slope = Vector2d(u_gradient.dot(line.direction), v_gradient.dot(line.direction)) * (ray.per_t * relief.tiling);
  const double x = u_gradient.stableNormalized().dot(line.direction) / ray.cosine;
  const double y = v_gradient.stableNormalized().dot(line.direction) / ray.cosine;
  ray.bend = relief.depth * (curvature.x() * x * x + curvature.y() * y * y + curvature.z() * x * y);
  return ray;
}

}  // namespace reliefbench
