#include "tuner/measure/stress.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <set>

#include "kernels/base/cache.h"
#include "kernels/base/error.h"
#include "kernels/image/heightmap.h"
#include "kernels/judge/heat_map.h"
#include "kernels/judge/score.h"
#include "kernels/trace/guarantee.h"
#include "kernels/trace/surface_tracer.h"
#include "tuner/measure/frame.h"
#include "tuner/measure/progress.h"
#include "tuner/measure/session.h"
#include "tuner/plan/plan.h"

namespace reliefbench {
namespace {

/// Floats tell too little of the bend of rays that graze more than this.
constexpr double kLeastBentCosine = 0.02;
constexpr double kFrameTimeout_s = 300;  ///< a software rasteriser takes seconds

std::int64_t& fault(StressResult& result, StressCheck check) {
  return result.faults.at(static_cast<std::size_t>(check));
}

bool has_ray(const ScorePixel& pixel) { return pixel.status != static_cast<float>(PixelStatus::no_ray); }

bool is_finite(const ScorePixel& pixel) {
  const TextureRay& ray = pixel.ray;
  const std::array values{ray.u, ray.v, ray.slope_u, ray.slope_v, pixel.t, pixel.status, pixel.taps, pixel.steps};
  return std::ranges::all_of(values, [](float value) { return std::isfinite(value); });
}

/// A map, and the exact tracer of its heights as they are stored.
struct StoredMap {
  StoredMap(BakedMap baked, Wrap wrap) : map(std::move(baked)), tracer(map.heights, wrap) {}
  BakedMap map;
  ReferenceTracer tracer;
};

/// One frame of a setting: hits, and what its features of the scene made of them.
struct StressFrame {
  StressFrame(Backend& backend, std::span<const Draw> draws, const Settings& settings, const Mesh* on_mesh)
      : pixels(trace_frame(backend, draws)),
        values(backend.read_values(pixel_features(settings))),
        uniforms(draws.front().frame),
        mesh(on_mesh) {}

  std::vector<ScorePixel> pixels;
  FeatureValues values;
  FrameUniforms uniforms;
  const Mesh* mesh;  ///< null: it is on none

  [[nodiscard]] bool is_same(const StressFrame& other) const {
    return std::memcmp(pixels.data(), other.pixels.data(), pixels.size() * sizeof(ScorePixel)) == 0 &&
           values == other.values;
  }
};

/// Values in [0, 1], and guarantees of the rays that they were traced with.
void check_values(const StressFrame& frame, const Settings& settings, const StoredMap& stored, StressResult& result) {
  const std::vector<PixelFeature> features = pixel_features(settings);
  for (std::size_t i = 0; i < features.size(); ++i) {
    for (const float value : frame.values[i]) {
      if (!std::isfinite(value)) ++fault(result, StressCheck::finite);
      if (!(value >= 0 && value <= 1)) ++fault(result, StressCheck::inside);
    }
    const PixelValue& value = *features[i].feature->value;
    if (guarantee_of(settings, value.query) != Guarantee::none)
      fault(result, StressCheck::guarantee) +=
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
      if (ray.cosine >= kLeastBentCosine)
        kept[i] = keeps_bent(guarantee, pixels[i], {ray.bend, ray.bend_blur}, surface, wrap);
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

/// What one frame says by itself.
JudgedFrame check_frame(const StressFrame& frame, const Settings& settings, const StoredMap& stored, Wrap wrap,
                        StressResult& result) {
  const std::vector<ScorePixel>& pixels = frame.pixels;
  const double most_t = bends_rays(settings) ? kMostBentT : 1;
  check_values(frame, settings, stored, result);
  const auto cap = static_cast<float>(step_cap(settings));
  for (const ScorePixel& pixel : pixels) {
    if (!has_ray(pixel)) continue;
    if (!is_finite(pixel)) ++fault(result, StressCheck::finite);
    if (!(pixel.t >= 0 && static_cast<double>(pixel.t) <= most_t)) ++fault(result, StressCheck::inside);
    if (pixel.steps > cap) ++fault(result, StressCheck::step_cap);
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
    if (kept == Kept::no) ++fault(result, StressCheck::guarantee);
    if (kept == Kept::unresolved) ++result.unresolved;
  }
  return judged;
}

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

void compare_frames(const std::vector<ScorePixel>& a, const std::vector<ScorePixel>& b, const FrameUniforms& frame,
                    Wrap wrap, StressResult& result) {
  // So much farther apart are hits, and so many more are the steps that end on another side of the surface.
  const double scale = tolerance_on(frame);
  std::int64_t differing = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const bool is_same = is_same_ray(a[i].ray, b[i].ray, frame, wrap, scale * kRayAgreement_texels);
    if (!is_same || !(apart(a[i].t, b[i].t) <= scale * kAgreement)) ++differing;
  }
  if (result.pixels == 0) return;
  result.differing_rate = static_cast<double>(differing) / static_cast<double>(result.pixels);
  if (result.differing_rate > scale * find_technique(result.technique).disagreement)
    fault(result, StressCheck::agreement) = differing;
}

class StressRun {
 public:
  StressRun(const Extremes& extremes, const StressOptions& options)
      : extremes_(extremes), options_(options), progress_(options.quiet) {
    for (const std::string& id : options.backends) {
      devices_.push_back(std::make_unique<Device>(find_backend(id), options.device, split_, options.open));
      if (options.simulated) devices_.back()->session.simulate_filter(*options.simulated);
    }
  }

  StressReport all() {
    plan();
    const auto total = static_cast<double>(planned_.size());
    for (std::size_t i = 0; i < planned_.size(); ++i) {
      const Planned& planned = planned_[i];
      progress_.update(static_cast<double>(i) / total,
                       fmt::format("{} at {}", planned.settings.technique().id, planned.extreme->id));
      run_one(planned);
    }
    progress_.finish();
    for (const auto& device : devices_) {
      const DeviceInfo& info = device->session.device();
      std::string text = fmt::format("{}: {}, {}", info.backend, info.name, info.driver);
      if (options_.simulated) text += fmt::format("; simulated filter: {}", filter_text(*options_.simulated));
      report_.devices.push_back(std::move(text));
    }
    for (auto& [technique, picture] : pictures_) report_.pictures.push_back(std::move(picture));
    report_.wall_s = split_.total_seconds();
    return std::move(report_);
  }

 private:
  struct Planned {
    const Extreme* extreme;
    Settings settings;
  };
  struct Device {
    Device(const BackendRow& row, int index, WallSplit& split, const OpenDevice& open)
        : session(row, index, split, false, open) {
      session.set_timeout(kFrameTimeout_s);
    }
    Session session;
    UploadedScene scene{};  // of the extreme
  };

  void plan() {
    std::vector<SettingChange> changes = extremes_.changes;
    if (options_.simulated) changes.emplace_back("filter", "hardware");
    std::set<std::string_view> asked;
    for (const Extreme& extreme : extremes_.list) {
      std::vector<std::pair<std::string, Planned>> here;  // by bake
      for (const Technique& technique : techniques())
        // Others see the upper surface of a solid alone, as if it were a relief: extremes of that are above.
        if (technique.is_of_solids() == is_solid(extreme.scene.heightmap))
          for (Settings& settings : stress_settings(technique, changes, extreme))
            if (options_.filter.empty() || glob_matches(options_.filter, name_of(extreme, settings))) {
              std::string bake = bake_text(settings, extreme.scene);
              here.emplace_back(std::move(bake), Planned{&extreme, std::move(settings)});
            }
      std::ranges::stable_sort(here, {}, &std::pair<std::string, Planned>::first);
      if (!here.empty()) report_.extremes.push_back(extreme);
      for (auto& [bake, planned] : here) {
        asked.insert(planned.settings.technique().id);
        planned_.push_back(std::move(planned));
      }
    }
    if (planned_.empty()) fail_input("stress: the filter '{}' matches nothing", options_.filter);
    for (const Technique& technique : techniques())
      if (asked.contains(technique.id)) report_.techniques.emplace_back(technique.id);
  }

  static std::string_view format_of(const Settings& settings) {
    return settings.technique().reads_map() ? storage_of(settings).format.id : "";
  }

  static std::string name_of(const Extreme& extreme, const Settings& settings) {
    return fmt::format("{}/{}/{}/{}", settings.technique().id, map_of(settings).id, format_of(settings), extreme.id);
  }

  StressResult blank(const Planned& planned) const {
    return {.extreme = planned.extreme->id,
            .technique = std::string(planned.settings.technique().id),
            .map = std::string(map_of(planned.settings).id),
            .format = std::string(format_of(planned.settings)),
            .settings = planned.settings.text(),
            .backend = {},
            .guarantee = guarantee_of(planned.settings)};
  }

  /// Reads the heights of an extreme and uploads what its frames share.
  void enter(const Extreme& extreme) {
    if (extreme_ == &extreme) return;
    extreme_ = nullptr;
    heights_ = load_heightmap(extreme.scene.heightmap);
    for (const auto& device : devices_) {
      drawing_ = device.get();
      device->scene = upload(device->session.backend(), extreme.scene.scene, heights_);
    }
    extreme_ = &extreme;
  }

  std::string reason_to_skip(const Planned& planned) const {
    if (!planned.extreme->is_large) return "";
    if (!options_.is_large) return "large maps are run with --large";
    return map_of(planned.settings).sees_pairs ? "its baker looks at every pair of texels: days at this size" : "";
  }

  void run_one(const Planned& planned) {
    const Extreme& extreme = *planned.extreme;
    StressResult result = blank(planned);
    result.skipped = reason_to_skip(planned);
    if (!result.skipped.empty()) {
      report_.results.push_back(result);
      return;
    }
    std::optional<std::vector<ScorePixel>> first;
    try {
      enter(extreme);
      const Settings& settings = planned.settings;
      const Scene& scene = extreme.scene.scene;
      const StoredMap& stored = recent_.get(fmt::format("{}|{}", extreme.id, bake_text(settings, extreme.scene)), [&] {
        return StoredMap(bake(bake_spec(settings, scene.wrap), heights_), scene.wrap);
      });
      const std::optional<MapTextures> textures = pack(settings, stored.map, scene);
      for (const auto& device : devices_) {
        drawing_ = device.get();
        StressResult here = result;
        here.backend = device->session.device().backend;
        if (textures) here.skipped = device->session.device().refusal(textures->relief.layout.type);
        if (!here.skipped.empty()) {
          report_.results.push_back(std::move(here));
          continue;
        }
        Backend& backend = device->session.backend();
        const Frame frame = upload(backend, textures, device->scene);
        const std::vector<Draw> draws = device->session.scored(settings, scene, frame.draw);
        const Mesh* const mesh = device->scene.mesh.get();
        std::array frames{StressFrame(backend, draws, settings, mesh), StressFrame(backend, draws, settings, mesh)};
        const JudgedFrame judged = check_frame(frames[0], settings, stored, scene.wrap, here);
        if (!frames[0].is_same(frames[1])) fault(here, StressCheck::repeatable) = 1;
        if (first) compare_frames(*first, frames[0].pixels, frames[0].uniforms, scene.wrap, here);
        if (!first) first = std::move(frames[0].pixels);
        keep_worst(here, judged, scene);
        report_.results.push_back(std::move(here));
      }
    } catch (const Error& error) {
      result.is_lost = needs_reopening(error.fault()) || error.fault() == Fault::out_of_memory;
      if (error.code() != Exit::bad_input && !result.is_lost) throw;
      result.skipped = error.what();
      if (result.is_lost) leave(error.fault(), result);
      report_.results.push_back(std::move(result));
    }
  }

  /// Takes the device that failed off the extreme, and opens it again if it is lost.
  void leave(Fault fault, StressResult& result) {
    result.backend = drawing_->session.device().backend;
    extreme_ = nullptr;
    drawing_->scene = {};
    if (drawing_->session.is_lost(fault)) drawing_->session.reopen();
  }

  void keep_worst(const StressResult& result, const JudgedFrame& judged, const Scene& scene) {
    const auto found = pictures_.find(result.technique);
    if (found != pictures_.end() && found->second.result.e_xy_p99 >= result.e_xy_p99) return;
    pictures_[result.technique] = {.technique = result.technique,
                                   .result = result,
                                   .rgba8 = heat_map(judged.pixels, scene.width_px, scene.height_px),
                                   .width = scene.width_px,
                                   .height = scene.height_px};
  }

  const Extremes& extremes_;
  const StressOptions& options_;
  WallSplit split_;
  Progress progress_;
  std::vector<std::unique_ptr<Device>> devices_;
  Device* drawing_ = nullptr;  ///< of them, the last that was asked for anything
  std::vector<Planned> planned_;
  const Extreme* extreme_ = nullptr;  // that heights_ and the devices' scenes are of
  Heightfield heights_;
  Recent<StoredMap> recent_{1};  // large maps: not two at once
  std::map<std::string, StressPicture> pictures_;
  StressReport report_;
};

}  // namespace

bool StressResult::holds() const {
  return !is_lost && std::ranges::all_of(faults, [](std::int64_t pixels_at_fault) { return pixels_at_fault == 0; });
}

bool StressReport::holds() const { return std::ranges::all_of(results, &StressResult::holds); }

StressReport run_stress(const Extremes& extremes, const StressOptions& options) {
  return StressRun(extremes, options).all();
}

}  // namespace reliefbench
