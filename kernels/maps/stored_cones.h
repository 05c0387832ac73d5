#pragma once
#include <array>
#include <vector>

#include "kernels/maps/map_texture.h"

namespace reliefbench {

/// A stored map as shaders see it between the texels, without their rounding: stored values are interpolated
/// bilinearly, then decoded.
class StoredCones {
 public:
  /// is_min4: the cone of a point is the least of its four texels' (Correction::min4). channel: which of the ratios
  StoredCones(const MapTextures& textures, const Format& format, const Encoding& encoding, Wrap wrap, bool is_min4,
              int channel = 0);
  /// stored: one value a texel
  StoredCones(Heightfield heights, std::vector<float> stored, const Encoding& encoding, Wrap wrap, bool is_min4);

  /// Four texels, (0,0), (1,0), (0,1), (1,1).
  struct Cell {
    std::array<double, 4> heights;
    std::array<double, 4> stored;
  };
  [[nodiscard]] Cell cell(int x, int y) const;  ///< with lower left texel x, y, wrapped

  /// A cell, and where in it.
  struct Place {
    Cell cell;
    double fx, fy;
  };
  [[nodiscard]] Place at(double u, double v) const;

  [[nodiscard]] static double height(const Cell& cell, double fx, double fy);
  [[nodiscard]] double ratio(const Cell& cell, double fx, double fy) const;

  struct Box {
    double fx0, fy0, fx1, fy1;
  };
  /// A ratio that no point of the box exceeds: the greatest of its corners. A bilinear value through a monotone
  /// function has its maximum there, and so has a quotient R/D of two bilinear ones, D > 0, which is monotone along
  /// each axis. Where D = 0 at a corner, R must be 0 too; the quotient is then constant along the edges from there, and
  /// that corner adds nothing. h_tan's decoding R/max(D, e) is at most R/D.
  [[nodiscard]] double widest(const Cell& cell, const Box& box) const;

  [[nodiscard]] const Heightfield& heights() const { return heights_; }
  [[nodiscard]] const std::vector<float>& at_texels() const { return ratios_; }  ///< decoded in float, as shaders do
  [[nodiscard]] Wrap wrap() const { return wrap_; }
  /// Cells along each axis: as many as texels under repeat, one less under clamp (constant beyond the border).
  [[nodiscard]] int cells_x() const { return heights_.width - (wrap_ == Wrap::clamp ? 1 : 0); }
  [[nodiscard]] int cells_y() const { return heights_.height - (wrap_ == Wrap::clamp ? 1 : 0); }
  /// A ratio that no point's and no texel's exceeds.
  [[nodiscard]] float greatest() const;

 private:
  Encoding encoding_;
  Wrap wrap_;
  bool is_min4_;
  Heightfield heights_;
  std::vector<float> stored_;
  std::vector<float> ratios_;
};

}  // namespace reliefbench
