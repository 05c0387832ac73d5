#pragma once
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <initializer_list>
#include <string>
#include <vector>

#include "kernels/maps/cone_map.h"
#include "tests/cone_test_maps.h"

namespace reliefbench {

inline constexpr Correction kCorrections[] = {Correction::none, Correction::min3x3, Correction::safe};

inline std::string label(std::string_view id, const Heightfield& map, Wrap wrap,
                         Correction correction = Correction::none) {
  return fmt::format("{} {}x{} {} {}", id, map.width, map.height, wrap == Wrap::repeat ? "repeat" : "clamp",
                     correction_id(correction));
}

/// Every test map, wrap and correction.
template <class Body>
void for_each_request(std::initializer_list<MapSize> sizes, const Body& body) {
  for (const ConeTestMap& map : kConeTestMaps) {
    for (const auto& [width, height] : sizes) {
      const Heightfield heights = map.make(width, height);
      for (const Wrap wrap : kWraps) {
        for (const Correction correction : kCorrections) {
          SCOPED_TRACE(label(map.id, heights, wrap, correction));
          body(BakeRequest{.heights = heights, .wrap = wrap, .correction = correction, .threads = 1});
        }
      }
    }
  }
}

/// The slow maps have no 3x3 minimum of their own.
inline std::vector<float> corrected(std::vector<float> ratios, const BakeRequest& request) {
  if (request.correction == Correction::none) return ratios;
  return min3x3(ratios, request.heights.width, request.heights.height, request.wrap);
}

inline Heightfield random_map(int max_side) {
  const int width = *rc::gen::inRange(2, max_side);
  const int height = *rc::gen::inRange(2, max_side);
  const int levels = *rc::gen::element(1, 2, 5, 255, 65535);  // few levels: many ties
  const auto codes =
      *rc::gen::container<std::vector<int>>(static_cast<std::size_t>(width) * height, rc::gen::inRange(0, levels + 1));
  return make_map(width, height, [&](int x, int y) {
    return static_cast<float>(codes[static_cast<std::size_t>(y) * width + x]) / static_cast<float>(levels);
  });
}

inline BakeRequest random_request(const Heightfield& heights) {
  return {.heights = heights,
          .wrap = *rc::gen::element(Wrap::repeat, Wrap::clamp),
          .correction = *rc::gen::element(Correction::none, Correction::min3x3, Correction::safe),
          .max_ratio = *rc::gen::element(1.0F, kUnboundedRatio),
          .threads = *rc::gen::element(1, 2)};
}

}  // namespace reliefbench
