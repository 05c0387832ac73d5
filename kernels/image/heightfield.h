#pragma once
#include <array>
#include <cstddef>
#include <string_view>
#include <vector>

#include "kernels/base/suggest.h"

namespace reliefbench {

/// How texel indices and uv outside the map are answered. Bake and trace agree on it, always.
enum class Wrap { repeat, clamp };
struct WrapRow {
  std::string_view id;
  Wrap wrap;
};
inline constexpr std::array kWrapRows{WrapRow{"repeat", Wrap::repeat}, WrapRow{"clamp", Wrap::clamp}};  ///< as in Wrap
[[nodiscard]] constexpr std::string_view wrap_id(Wrap wrap) { return kWrapRows.at(static_cast<std::size_t>(wrap)).id; }
/// throws: Error(bad_input): as find_row()
[[nodiscard]] inline Wrap find_wrap(std::string_view id) { return find_row(kWrapRows, "wrap", id).wrap; }

/// A heightmap: width x height floats in [0,1], 1 = the top plate, row-major, texel centres at ((x+0.5)/width,
/// (y+0.5)/height) in uv. The surface is the bilinear interpolation of the texels.
struct Heightfield {
  int width = 0;
  int height = 0;
  std::vector<float> texels;
  /// Of a solid, as many: the heights of its lower surface, bilinear too. It fills what is between the surfaces
  /// wherever texels are over floors; elsewhere there is nothing, and a ray may pass. Empty: a relief, solid down to
  /// the bottom.
  std::vector<float> floors{};

  [[nodiscard]] float at(int x, int y) const { return texels[index(x, y)]; }
  [[nodiscard]] bool is_solid() const { return !floors.empty(); }
  [[nodiscard]] float floor_at(int x, int y) const { return floors[index(x, y)]; }
  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
};

/// Texel index `i` (any integer) brought into [0, n).
[[nodiscard]] constexpr int wrapped(int i, int n, Wrap wrap) {
  if (wrap == Wrap::clamp) return i < 0 ? 0 : (i >= n ? n - 1 : i);
  const int r = i % n;
  return r < 0 ? r + n : r;
}

}  // namespace reliefbench
