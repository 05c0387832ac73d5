#pragma once
#include <cstddef>
#include <vector>

#include "kernels/base/cache.h"
#include "kernels/judge/score.h"
#include "tuner/measure/bake.h"

namespace reliefbench {

// What the cache holds, as bytes: a line that says what follows, of which layout and how much, then the values one by
// one. Numbers are IEEE 754, little endian. What does not read back as just what was asked for is nothing.

[[nodiscard]] Codec<BakedValues> bake_codec(std::size_t values);
/// How many values the kind's baker returns for such heights.
[[nodiscard]] std::size_t baked_value_count(const MapRow& map, const BakeRequest& request);
[[nodiscard]] Codec<std::vector<ReferenceHit>> hits_codec(std::size_t hits);
[[nodiscard]] Codec<std::vector<float>> values_codec(std::size_t values);  ///< of a feature of the scene
[[nodiscard]] Codec<FrameScore> score_codec();

}  // namespace reliefbench
