#include <algorithm>
#include <cmath>
#include <vector>

#include "kernels/base/parallel.h"
#include "kernels/maps/map_verify.h"
#include "kernels/maps/omni_table.h"

namespace reliefbench {
namespace {

constexpr double kHitRounding = 0x1p-24;  ///< of a hit, before the format's

/// Half the way to the format's farther neighbour of a value in [0, 1].
double half_code(float stored, TexelType type) {
  const std::uint32_t code = nearest_code(stored, type);
  double half = 0;
  if (stored < 1) half = static_cast<double>(value_of(code + 1, type)) - static_cast<double>(stored);
  if (code > 0) half = std::max(half, static_cast<double>(stored) - static_cast<double>(value_of(code - 1, type)));
  return half / 2;
}

}  // namespace

TableVerdict verify_omni(const VerifyRequest& request) {
  const OmniTable table(request.parameters);
  const ReferenceTracer tracer({.width = request.textures.relief.width,
                                .height = request.textures.relief.height,
                                .texels = read_channel(request.textures.relief, 0)},
                               request.wrap);
  const std::vector<float> stored = read_channel(request.textures.extra.value(), 0);
  std::vector<TableVerdict> rows(static_cast<std::size_t>(table.height()));
  parallel_for(table.height(), request.threads, [&](int row) {
    TableVerdict& found = rows[static_cast<std::size_t>(row)];
    for (int column = 0; column < table.width(); ++column) {
      const float value = stored[static_cast<std::size_t>(row) * static_cast<std::size_t>(table.width()) +
                                 static_cast<std::size_t>(column)];
      const double exact = tracer.trace(table.ray(table.node_at(column, row))).t_enter;
      const double off = std::abs(static_cast<double>(value) - exact);
      ++found.values;
      found.worst_off = std::max(found.worst_off, off);
      if (!(off <= half_code(value, request.format.type) + kHitRounding)) ++found.wrong;
    }
  });
  TableVerdict sum;
  for (const TableVerdict& row : rows) {
    sum.values += row.values;
    sum.wrong += row.wrong;
    sum.worst_off = std::max(sum.worst_off, row.worst_off);
  }
  return sum;
}

}  // namespace reliefbench
