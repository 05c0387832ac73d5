#pragma once
#include <cmath>

#include "kernels/image/heightfield.h"
#include "kernels/trace/surface_tracer.h"

namespace reliefbench {

/// An oracle that shares nothing with the tracer: long doubles, steps of a thousandth of the shell, bisection.
class SlowSurface {
 public:
  using Real = long double;
  SlowSurface(const Heightfield& map, const SurfaceShape& shape, Wrap wrap) : map_(map), shape_(shape), wrap_(wrap) {}

  /// Height of the way's point over the surface, its own height, and whether it is on the patch.
  struct At {
    Real gap;
    Real height;
    bool is_on;
  };
  [[nodiscard]] At at(const SurfaceRay& ray, Real way) const {
    const Real x = Real(ray.from[0]) + Real(ray.direction[0]) * way - 0.5L;
    const Real y = Real(ray.from[1]) + Real(ray.direction[1]) * way - 0.5L;
    const Real ring = shape_.ring, tube = shape_.tube;
    const Real z = Real(ray.from[2]) + Real(ray.direction[2]) * way + ring + tube;
    const Real angle = std::atan2(x, z);
    Real height = 0, u = 0, v = 0;
    if (shape_.kind == SurfaceKind::cylinder) {
      height = std::sqrt(x * x + z * z);
      u = 0.5L + tube * angle;
      v = 0.5L + y;
    } else {
      const Real across = std::sqrt(x * x + z * z) - ring;
      height = std::sqrt(across * across + y * y);
      u = 0.5L + (ring + tube) * angle;
      v = 0.5L + tube * std::atan2(y, across);
    }
    height = 1 - (tube - height) / Real(shape_.relief);
    return {.gap = height - surface(u * Real(shape_.tiling), v * Real(shape_.tiling)),
            .height = height,
            .is_on = wrap_ == Wrap::repeat || (u >= 0 && u <= 1 && v >= 0 && v <= 1)};
  }
  /// The way to the first hit; negative: it passes.
  [[nodiscard]] Real first_hit(const SurfaceRay& ray) const {
    const Real step = Real(shape_.relief) / 4000;
    Real last = ray.way;
    if (at(ray, last).gap <= 1e-12L) return last;
    for (Real way = last + step;; way += step) {
      const At here = at(ray, way);
      if (here.gap <= 0) {
        Real over = last, under = way;
        for (int i = 0; i < 80; ++i) {
          const Real middle = (over + under) / 2;
          (at(ray, middle).gap > 0 ? over : under) = middle;
        }
        return at(ray, under).is_on ? under : -1;
      }
      if (here.height > 1.000001L || !here.is_on) return -1;
      last = way;
    }
  }

 private:
  /// floor(); the library's of long doubles takes ten times as long.
  static int whole(Real x) {
    const int towards_zero = static_cast<int>(x);
    return x < towards_zero ? towards_zero - 1 : towards_zero;
  }
  [[nodiscard]] Real surface(Real u, Real v) const {
    const Real x = u * map_.width - 0.5L, y = v * map_.height - 0.5L;
    const int left = whole(x), low = whole(y);
    const Real fx = x - left, fy = y - low;
    const auto texel = [&](int i, int j) {
      return Real(map_.at(wrapped(left + i, map_.width, wrap_), wrapped(low + j, map_.height, wrap_)));
    };
    return (texel(0, 0) * (1 - fx) + texel(1, 0) * fx) * (1 - fy) + (texel(0, 1) * (1 - fx) + texel(1, 1) * fx) * fy;
  }

  const Heightfield& map_;
  const SurfaceShape& shape_;
  Wrap wrap_;
};

}  // namespace reliefbench
