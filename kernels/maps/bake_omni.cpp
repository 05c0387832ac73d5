#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "kernels/base/error.h"
#include "kernels/base/parallel.h"
#include "kernels/image/image.h"
#include "kernels/maps/omni_table.h"

namespace reliefbench {
namespace {

/// Of the middle of part `i` of `n`.
double middle(int i, int n) { return (i + 0.5) / n; }

}  // namespace

OmniTable::OmniTable(std::span<const MapValue> parameters)
    : x(given_value(parameters, kOmniParams[0])),
      y(given_value(parameters, kOmniParams[1])),
      a(given_value(parameters, kOmniParams[2])),
      b(given_value(parameters, kOmniParams[3])),
      is_by_direction(kOmniOrders.at(static_cast<std::size_t>(given_value(parameters, kOmniParams[4]))) == "abxy"),
      is_octahedral(kOmniDirections.at(static_cast<std::size_t>(given_value(parameters, kOmniParams[5]))) ==
                    "octahedral") {}

OmniTable::Node OmniTable::node_at(int column, int row) const {
  if (is_by_direction) return {.x = column % x, .y = row % y, .a = column / x, .b = row / y};
  return {.x = column / a, .y = row / b, .a = column % a, .b = row % b};
}

TextureRay OmniTable::ray(const Node& node) const {
  double slope_s = 0;
  double slope_t = 0;
  if (is_octahedral) {
    const double sum = 2 * middle(node.a, a) - 1;
    const double difference = 2 * middle(node.b, b) - 1;
    const double down = 1 - std::max(std::abs(sum), std::abs(difference));
    slope_s = (sum + difference) / 2 / down;
    slope_t = (sum - difference) / 2 / down;
  } else {
    const double alpha = std::numbers::pi * middle(node.a, a);
    const double beta = std::numbers::pi * middle(node.b, b);
    slope_s = std::cos(alpha) / std::sin(alpha);
    slope_t = std::cos(beta) / (std::sin(beta) * std::sin(alpha));
  }
  constexpr auto kTile = static_cast<double>(kOmniTile);
  return {.u = static_cast<float>(middle(node.x, x)),
          .v = static_cast<float>(middle(node.y, y)),
          .slope_u = static_cast<float>(slope_s / kTile),
          .slope_v = static_cast<float>(slope_t / kTile)};
}

std::string omni_refusal(std::span<const MapValue> parameters) {
  const OmniTable table(parameters);
  if (table.width() <= kMaxSide && table.height() <= kMaxSide) return "";
  return fmt::format(
      "an omni table of {} x {} positions and {} x {} directions is a texture of {} x {} texels, "
      "expected at most {} a side",
      table.x, table.y, table.a, table.b, table.width(), table.height(), kMaxSide);
}

std::vector<float> bake_omni(const BakeRequest& request) {
  check_request(request, MapKind::omni);
  if (const std::string reason = omni_refusal(request.parameters); !reason.empty()) fail_input("{}", reason);
  const OmniTable table(request.parameters);
  const ReferenceTracer tracer(request.heights, request.wrap);
  const auto width = static_cast<std::size_t>(table.width());
  std::vector<float> values(width * static_cast<std::size_t>(table.height()));
  parallel_for(table.height(), request.threads, [&](int row) {
    float* const texels = &values[static_cast<std::size_t>(row) * width];
    for (int column = 0; column < table.width(); ++column)
      texels[column] = static_cast<float>(tracer.first_hit(table.ray(table.node_at(column, row))));
  });
  return values;
}

}  // namespace reliefbench
