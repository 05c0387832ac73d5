#include "kernels/maps/stored_cones.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace reliefbench {
namespace {

double bilinear(const std::array<double, 4>& corners, double fx, double fy) {
  return (corners[0] * (1 - fx) + corners[1] * fx) * (1 - fy) + (corners[2] * (1 - fx) + corners[3] * fx) * fy;
}

}  // namespace

StoredCones::StoredCones(const MapTextures& textures, const Format& format, const Encoding& encoding, Wrap wrap,
                         bool is_min4, int channel)
    : StoredCones({.width = textures.relief.width,
                   .height = textures.relief.height,
                   .texels = read_channel(textures.relief, 0)},
                  format.extra_channels > 0 ? read_channel(textures.extra.value(), channel)
                                            : read_channel(textures.relief, 1 + channel),
                  encoding, wrap, is_min4) {}

StoredCones::StoredCones(Heightfield heights, std::vector<float> stored, const Encoding& encoding, Wrap wrap,
                         bool is_min4)
    : encoding_(encoding), wrap_(wrap), is_min4_(is_min4), heights_(std::move(heights)), stored_(std::move(stored)) {
  ratios_.reserve(stored_.size());
  for (std::size_t i = 0; i < stored_.size(); ++i) ratios_.push_back(encoding_.decode(stored_[i], heights_.texels[i]));
}

StoredCones::Cell StoredCones::cell(int x, int y) const {
  Cell result{};
  for (int i = 0; i < 4; ++i) {
    const int column = wrapped(x + i % 2, heights_.width, wrap_);
    const int row = wrapped(y + i / 2, heights_.height, wrap_);
    const std::size_t texel =
        static_cast<std::size_t>(row) * static_cast<std::size_t>(heights_.width) + static_cast<std::size_t>(column);
    result.heights.at(static_cast<std::size_t>(i)) = heights_.texels[texel];
    result.stored.at(static_cast<std::size_t>(i)) = stored_[texel];
  }
  return result;
}

StoredCones::Place StoredCones::at(double u, double v) const {
  const auto texels = [&](double uv, int side) {
    const double x = uv * side - 0.5;
    return wrap_ == Wrap::clamp ? std::clamp(x, 0.0, side - 1.0) : x - std::floor(x / side) * side;
  };
  const double x = texels(u, heights_.width);
  const double y = texels(v, heights_.height);
  const double left = std::floor(x);
  const double low = std::floor(y);
  return {.cell = cell(static_cast<int>(left), static_cast<int>(low)), .fx = x - left, .fy = y - low};
}

double StoredCones::height(const Cell& cell, double fx, double fy) { return bilinear(cell.heights, fx, fy); }

double StoredCones::ratio(const Cell& cell, double fx, double fy) const {
  if (!is_min4_) return encoding_.decode_exact(bilinear(cell.stored, fx, fy), bilinear(cell.heights, fx, fy));
  double least = encoding_.decode_exact(cell.stored[0], cell.heights[0]);
  for (std::size_t i = 1; i < 4; ++i)
    least = std::min(least, encoding_.decode_exact(cell.stored.at(i), cell.heights.at(i)));
  return least;
}

double StoredCones::widest(const Cell& cell, const Box& box) const {
  if (is_min4_) return ratio(cell, 0, 0);
  std::array<double, 4> depths{};
  std::transform(cell.heights.begin(), cell.heights.end(), depths.begin(), [](double height) { return 1 - height; });
  double greatest = 0;
  for (const double fy : {box.fy0, box.fy1}) {
    for (const double fx : {box.fx0, box.fx1}) {
      if (!encoding_.is_over_depth) {
        greatest = std::max(greatest, ratio(cell, fx, fy));
        continue;
      }
      const double radius = bilinear(cell.stored, fx, fy);
      const double depth = bilinear(depths, fx, fy);
      if (radius > 0) greatest = std::max(greatest, radius / depth);
    }
  }
  return greatest;
}

float StoredCones::greatest() const {
  double greatest = *std::max_element(ratios_.begin(), ratios_.end());
  for (int y = 0; y < cells_y(); ++y)
    for (int x = 0; x < cells_x(); ++x) greatest = std::max(greatest, widest(cell(x, y), {0, 0, 1, 1}));
  return static_cast<float>(std::min<double>(greatest, kUnboundedRatio)) * (1 + 0x1p-20F);
}

}  // namespace reliefbench
