#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "kernels/judge/score.h"
#include "kernels/maps/map_kind.h"

namespace reliefbench {

// What the cache holds, as bytes: a line that says what follows, of which layout and how much, then the values one by
// one. Numbers are IEEE 754, little endian. What does not read back as just what was asked for is nothing.

struct CachedBake {
  double time_ns = 0;         ///< when it was baked
  std::vector<float> values;  ///< as MapRow::content says
};
[[nodiscard]] std::vector<std::byte> bake_bytes(double time_ns, std::span<const float> values);
[[nodiscard]] std::optional<CachedBake> read_bake(std::span<const std::byte> bytes, std::size_t values);
/// How many values the kind's baker returns for such heights.
[[nodiscard]] std::size_t baked_value_count(const MapRow& map, const BakeRequest& request);

[[nodiscard]] std::vector<std::byte> hit_bytes(std::span<const ReferenceHit> hits);
[[nodiscard]] std::optional<std::vector<ReferenceHit>> read_hits(std::span<const std::byte> bytes, std::size_t hits);

[[nodiscard]] std::vector<std::byte> score_bytes(const FrameScore& score);
[[nodiscard]] std::optional<FrameScore> read_score(std::span<const std::byte> bytes);

}  // namespace reliefbench
