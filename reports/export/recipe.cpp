#include <fmt/format.h>

#include <array>

#include "kernels/base/error.h"
#include "reports/export/engine.h"

namespace reliefbench {
namespace {

/// What no engine's recipe does.
struct Refusal {
  std::string_view param;  ///< whose choice the words name; "": they name the technique
  bool (*is_so)(const ShippedShader& shader);
  std::string_view words;
};

constexpr std::array kRefusals = {
    Refusal{"fade", [](const ShippedShader& shader) { return shader.settings.is("fade", "distance"); },
            "passes the eye's distance in tiles that {} needs"},
    Refusal{"depth", [](const ShippedShader& shader) { return has_value_of(shader.settings, Query::depth); },
            "passes what {} needs"},
    Refusal{"silhouette", [](const ShippedShader& shader) { return takes_curvature(shader.settings); },
            "passes the curvature that {} needs"},
    Refusal{"dither", [](const ShippedShader& shader) { return shader.settings.is("dither", "pixel"); },
            "passes the pixel that {} needs"},
    Refusal{"dither", [](const ShippedShader& shader) { return is_dithered(shader.settings); },
            "passes the number of the frame that {} needs"},
    Refusal{"dispatch", [](const ShippedShader& shader) { return is_by_compute(shader.settings); },
            "is a compute shader, which {} measures"},
    Refusal{"", [](const ShippedShader& shader) { return shader.settings.technique().is_of_solids(); },
            "leaves out what {} lets pass"},
    Refusal{"silhouette", may_pass, "leaves out what {} lets pass"},
};

}  // namespace

void check_recipe(const Engine& engine, const ShippedShader& shader) {
  if (engine.id == kPlainEngine) return;
  const Settings& settings = shader.settings;
  for (const Refusal& row : kRefusals) {
    if (!row.is_so(shader)) continue;
    const std::string named = row.param.empty() ? std::string(settings.technique().id)
                                                : fmt::format("{}={}", row.param, settings.choice(row.param));
    fail_input("no engine's recipe {}; export it without --for", fmt::format(fmt::runtime(row.words), named));
  }
}

std::string mesh_words(const ShippedShader& shader) {
  const double depth = shader.relief_depth;
  if (shader.base == 1)
    return fmt::format("is the relief's top, and heights go down from it by {:#} sides of a tile.", depth);
  const std::string out =
      fmt::format("stand out of it by {:g} sides of a tile. What stands out is seen within the mesh's outline alone.",
                  (1 - shader.base) * depth);
  if (shader.base == 0) return fmt::format("is the relief's bottom, and heights {}", out);
  return fmt::format("lies at the height {:g} of the relief: heights go down from it by {:g} and {}", shader.base,
                     shader.base * depth, out);
}

}  // namespace reliefbench
