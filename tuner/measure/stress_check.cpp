#include "tuner/measure/stress_check.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "kernels/trace/guarantee.h"
#include "kernels/trace/surface_tracer.h"

namespace reliefbench {
namespace {

bool has_ray(const ScorePixel& pixel) { return pixel.status != static_cast<float>(PixelStatus::no_ray); }

bool is_finite(const ScorePixel& pixel) {
  const TextureRay& ray = pixel.ray;
  const std::array values{ray.u, ray.v, ray.slope_u, ray.slope_v, pixel.t, pixel.status, pixel.taps, pixel.steps};
  return std::ranges::all_of(values, [](float value) { return std::isfinite(value); });
}

/// Values in [0, 1], and guarantees of the rays that they were traced with.
void check_values(const StressFrame& frame, const Settings& settings, const StoredMap& stored, StressResult& result) {
  const std::vector<PixelFeature> features = pixel_features(settings);
  for (std::size_t i = 0; i < features.size(); ++i) {
    for (const float value : frame.values[i]) {
      if (!std::isfinite(value)) ++result.fault(StressCheck::finite);
      if (!(value >= 0 && value <= 1)) ++result.fault(StressCheck::inside);
    }
    const PixelValue& value = *features[i].feature->value;
    if (guarantee_of(settings, value.query) != Guarantee::none)
      result.fault(StressCheck::guarantee) +=
          value.broken(stored.tracer, frame.uniforms, frame.pixels, frame.values[i]);
  }
}

constexpr double kMostBentT = 4;  ///< where a bent ray ends at the latest: RAY_END of surface_bent.glsl

bool bends_rays(const Settings& settings) {
  const std::vector<PixelFeature> features = frame_features(settings);
  return std::ranges::any_of(features, [](const PixelFeature& one) {
    return std::ranges::find(one.row->defines, "BENT_RAYS") != one.row->defines.end();
  });
}

/// Whether each pixel's guarantee is kept: of the very ray that it traced, which on a curved surface is not the
/// world's.
std::vector<Kept> kept_of(const StressFrame& frame, const Settings& settings, const StoredMap& stored, Wrap wrap,
                          Guarantee guarantee) {
  const Heightfield& surface = stored.map.heights;
  std::vector<ScorePixel> pixels = frame.pixels;
  std::vector<Kept> kept(pixels.size(), Kept::yes);
  if (guarantee == Guarantee::none) return kept;
  if (bends_rays(settings)) {
    if (frame.mesh != nullptr) return kept;  // devices rasterise: a ray's bend is not known to the bit
    const SurfaceShape shape(frame.uniforms);
    const auto width = static_cast<std::size_t>(frame.uniforms.sizes[0]);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      if (!has_ray(pixels[i])) continue;
      const SurfaceRay ray =
          surface_ray(frame.uniforms, shape, wrap, static_cast<int>(i % width), static_cast<int>(i / width));
      if (ray.enters) kept[i] = keeps_bent(guarantee, pixels[i], {ray.bend, ray.bend_blur}, surface, wrap);
    }
    return kept;
  }
  // Where a surface is clipped, a ray passes by its hit: it has one all the same.
  if (!surface.is_solid())
    for (ScorePixel& pixel : pixels)
      if (pixel.status == static_cast<float>(PixelStatus::passed)) pixel.status = static_cast<float>(PixelStatus::hit);
  const std::vector<ReferenceHit> exact = exact_hits(stored.tracer, pixels);
  const PixelScores scores = judge_pixels(pixels, exact, surface.width, surface.height);
  for (std::size_t i = 0; i < pixels.size(); ++i)
    kept[i] = keeps(guarantee, pixels[i], scores[i], exact[i], surface, wrap);
  return kept;
}

}  // namespace

JudgedFrame check_frame(const StressFrame& frame, const Settings& settings, const StoredMap& stored, Wrap wrap,
                        StressResult& result) {
  const std::vector<ScorePixel>& pixels = frame.pixels;
  const double most_t = bends_rays(settings) ? kMostBentT : 1;
  check_values(frame, settings, stored, result);
  const auto cap = static_cast<float>(step_cap(settings));
  for (const ScorePixel& pixel : pixels) {
    if (!has_ray(pixel)) continue;
    if (!is_finite(pixel)) ++result.fault(StressCheck::finite);
    if (!(pixel.t >= 0 && static_cast<double>(pixel.t) <= most_t)) ++result.fault(StressCheck::inside);
    if (pixel.steps > cap) ++result.fault(StressCheck::step_cap);
    if (pixel.status == static_cast<float>(PixelStatus::step_cap)) ++result.capped;
  }
  const std::vector<ReferenceHit> exact = exact_hits(stored.tracer, frame.uniforms, wrap, pixels, frame.mesh);
  JudgedFrame judged = judge(frame.uniforms, wrap, stored.map.heights.is_solid(), pixels, exact);
  result.pixels = judged.score.pixels;
  result.missed_rate = judged.score.at("missed_rate");
  result.unconverged_rate = judged.score.at("unconverged_rate");
  result.e_xy_p99 = judged.score.at("e_xy.p99");
  result.e_xy_max = judged.score.at("e_xy.max");
  const std::vector<Kept> all = kept_of(frame, settings, stored, wrap, result.guarantee);
  for (const Kept kept : all) {
    if (kept == Kept::no) ++result.fault(StressCheck::guarantee);
    if (kept == Kept::unresolved) ++result.unresolved;
  }
  return judged;
}

namespace {

/// How many times kRayAgreement_texels the rays of a frame may differ by. On a curved surface, where a ray enters is an
/// angle of the driver's in floats: with many tiles round it, its last bits are worth more.
double tolerance_on(const FrameUniforms& frame) {
  if (!is_curved(frame.surface_kind())) return 1;
  const SurfaceShape shape(frame);
  const double farthest = 0.5 + std::numbers::pi * (shape.ring + shape.tube);
  const double texels = kPlaceUlps * static_cast<double>(std::numeric_limits<float>::epsilon()) * farthest *
                        shape.tiling * std::max(frame.sizes[2], frame.sizes[3]);
  return std::max(1.0, texels / kRayAgreement_texels);
}

double apart(float a, float b) { return std::abs(static_cast<double>(a) - static_cast<double>(b)); }

/// Of places on a tile, which with repeat have lost their whole tiles.
double apart_on_tile(float a, float b, Wrap wrap) {
  const double way = apart(a, b);
  return wrap == Wrap::repeat ? std::min(way, 1 - way) : way;
}

/// On a plane, rays are the same to the bit. Where a surface bends, their roots and angles are the driver's.
bool is_same_ray(const TextureRay& a, const TextureRay& b, const FrameUniforms& frame, Wrap wrap, double texels) {
  if (a.u == b.u && a.v == b.v && a.slope_u == b.slope_u && a.slope_v == b.slope_v) return true;
  if (!is_curved(frame.surface_kind())) return false;
  const double most_slope = kRayAgreement * std::hypot(a.slope_u, a.slope_v);
  return apart_on_tile(a.u, b.u, wrap) * frame.sizes[2] <= texels &&
         apart_on_tile(a.v, b.v, wrap) * frame.sizes[3] <= texels && apart(a.slope_u, b.slope_u) <= most_slope &&
         apart(a.slope_v, b.slope_v) <= most_slope;
}

}  // namespace

void compare_frames(const StressFrame& a, const StressFrame& b, Wrap wrap, StressResult& result) {
  // So much farther apart are hits, and so many more are the steps that end on another side of the surface.
  const double scale = tolerance_on(b.uniforms);
  std::int64_t differing = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    const ScorePixel& first = a.pixels[i];
    const ScorePixel& second = b.pixels[i];
    const bool is_same = is_same_ray(first.ray, second.ray, b.uniforms, wrap, scale * kRayAgreement_texels);
    if (!is_same || !(apart(first.t, second.t) <= scale * kAgreement)) ++differing;
  }
  if (result.pixels == 0) return;
  result.differing_rate = static_cast<double>(differing) / static_cast<double>(result.pixels);
  if (result.differing_rate > scale * find_technique(result.technique).disagreement)
    result.fault(StressCheck::agreement) = differing;
}

}  // namespace reliefbench
