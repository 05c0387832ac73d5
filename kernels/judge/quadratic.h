#pragma once
#include <cmath>

namespace reliefbench {

/// F(s) = f0 + b s + a s^2 for s in [0, length]: height of a ray above a surface inside one cell.
struct Quadratic {
  double f0;
  double b;
  double a;
  double f1;  ///< F(length), from the expression that the next cell uses for its f0
  double length;

  [[nodiscard]] double at(double s) const { return f0 + (b + a * s) * s; }
  [[nodiscard]] Quadratic negated() const { return {-f0, -b, -a, -f1, length}; }
  /// It falls at first, and turns on the way.
  [[nodiscard]] bool dips() const { return a > 0 && b < 0 && -b < 2 * a * length; }
};

/// b^2 - 4 a f0 without cancellation (Kahan's difference of products).
[[nodiscard]] inline double discriminant(const Quadratic& f) {
  const double product = 4 * f.a * f.f0;
  const double error = std::fma(-4 * f.a, f.f0, product);
  return std::fma(f.b, f.b, -product) + error;
}

/// Where F falls to zero, of its two roots, in [.., length]. root: that of the discriminant, >= 0. Also where rounding
/// made 0/0 or a root just beyond the end.
[[nodiscard]] inline double falling_zero(const Quadratic& f, double root) {
  const double s = f.b <= 0 ? 2 * f.f0 / (root - f.b) : (f.b + root) / (-2 * f.a);
  return s < f.length ? s : f.length;
}

}  // namespace reliefbench
