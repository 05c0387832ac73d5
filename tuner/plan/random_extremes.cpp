#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>

#include "kernels/base/embedded.h"
#include "kernels/base/error.h"
#include "kernels/image/heightmap.h"
#include "kernels/mesh/meshes.h"
#include "kernels/trace/surface.h"
#include "tuner/plan/config_assets.h"
#include "tuner/plan/extremes.h"

namespace reliefbench {
namespace {

using nlohmann::json;

constexpr int kOddSides[] = {2, 3, 5, 7, 8, 16, 17, 31, 32, 33, 45, 64};
constexpr int kStepCounts[] = {0, 1, 2, 3, 8, 32, 200};

/// The standard's distributions differ between libraries; these do not.
class Dice {
 public:
  explicit Dice(std::seed_seq&& seed) : random_(seed) {}
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(random_() >> 11U) * 0x1p-53;
  }
  /// Every factor as likely.
  double about(double low, double high) { return low * std::pow(high / low, between(0, 1)); }
  bool one_in(double times) { return between(0, times) < 1; }
  template <typename Range>
  const auto& of(const Range& range) {
    const auto count = static_cast<double>(std::size(range));
    return std::data(range)[static_cast<std::size_t>(between(0, count))];
  }

 private:
  std::mt19937_64 random_;
};

/// Four digits, so that people can read the file.
double rounded(double value) {
  const double unit = std::pow(10, std::floor(std::log10(std::abs(value) + 1e-9)) - 3);
  return std::round(value / unit) * unit;
}

json random_view(Dice& dice) {
  const double elevation = dice.one_in(3) ? dice.about(0.1, 15) : dice.between(0.2, 90);
  return {{"id", "any"},
          {"elevation_deg", rounded(elevation)},
          {"azimuth_deg", dice.one_in(5) ? 45.0 * std::floor(dice.between(-4, 4)) : rounded(dice.between(-180, 180))},
          {"distance", rounded(dice.about(0.3, 6))},
          {"fov_deg", rounded(dice.between(5, 110))}};
}

json random_surface(Dice& dice) {
  const SurfaceRow& row = dice.of(surfaces());
  json surface = {{"kind", row.id}};
  if (row.has_tube) {
    const double tube = std::floor(dice.between(1, 4));
    surface["tube"] = tube;
    surface["round"] = std::floor(tube * dice.between(2, 4)) + 1;
  } else if (row.has_round) {
    surface["round"] = std::floor(dice.between(1, 7));
  }
  if (row.has_mesh) {
    surface["mesh"] = dice.of(named_meshes()).id;
    surface["segments"] = 1 << static_cast<int>(dice.between(1, 4));
  }
  return surface;
}

json random_scene(Dice& dice) {
  json scene = {{"heightmap",
                 {{"source", dice.of(procedurals()).id},
                  {"width", dice.of(kOddSides)},
                  {"height", dice.of(kOddSides)},
                  {"seed", static_cast<int>(dice.between(0, 1000))}}},
                {"views", random_view(dice)},
                {"wrap", dice.one_in(2) ? "clamp" : "repeat"},
                {"relief_depth", rounded(dice.about(0.01, 2))}};
  if (dice.one_in(2.5)) scene["surface"] = random_surface(dice);
  if (dice.one_in(2.5)) scene["tiling"] = dice.one_in(2) ? rounded(dice.about(0.1, 20)) : std::floor(dice.about(1, 20));
  if (dice.one_in(4)) scene["base"] = rounded(dice.between(0, 1));
  return scene;
}

}  // namespace

Extremes random_extremes(int count, std::uint64_t seed) {
  json text =
      json::parse(embedded_text(embedded_extremes(), kBuiltInExtremes), nullptr, true, /*ignore_comments=*/true);
  Extremes extremes = built_in_extremes();
  extremes.list.clear();
  for (int i = 0; i < count; ++i) {
    const std::string id = fmt::format("{}_{}", seed, i);
    Dice dice(std::seed_seq{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32U),
                            static_cast<std::uint32_t>(i)});
    std::optional<Extremes> one;
    while (!one) {
      const json scene = random_scene(dice);
      json extreme = {{"id", id}, {"about", scene.dump()}, {"scene", scene}};
      if (dice.one_in(4)) extreme["settings"] = {{"steps", dice.of(kStepCounts)}};
      text["extremes"] = json::array({std::move(extreme)});
      try {
        one = parse_extremes(text.dump(), "--random");
      } catch (const Error&) {  // a scene that no config may have is drawn again
      }
    }
    extremes.list.push_back(std::move(one->list.front()));
  }
  return extremes;
}

}  // namespace reliefbench
