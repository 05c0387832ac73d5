#include "tuner/measure/prepare.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "kernels/base/clock.h"
#include "kernels/base/error.h"
#include "kernels/base/sha256.h"
#include "kernels/judge/heat_map.h"
#include "kernels/trace/mesh_frame.h"
#include "kernels/trace/surface_tracer.h"
#include "tuner/measure/cached_values.h"
#include "tuner/measure/frame_draws.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/stages.h"

namespace reliefbench {
namespace {

constexpr double kPanTexels = 0.25;  // of the moving camera, a frame

template <typename T>
std::string hash_of(const std::vector<T>& values) {
  return sha256(std::as_bytes(std::span(values)));
}

/// What exact hits depend on beside a frame's numbers.
std::string mesh_text(const Surface& surface) {
  if (surface.kind != SurfaceKind::mesh) return "";
  return fmt::format(" {} {}", MeshTracer::kVersion, surface.sha256);
}

/// Why there is nothing to judge in a frame; "" where there is. Without a pixel every error would be 0.
std::string blank_fault(const FrameScore& score) {
  return score.pixels > 0 ? "" : "the camera looks past the relief: no pixel's ray meets it";
}

}  // namespace

Record blank_record(const Case& c, const SceneKey& scene_key, const DeviceInfo& device) {
  Record record;
  record.case_id = c.id();
  record.technique = c.settings.technique().id;
  for (const SettingValue& given : c.settings.written()) record.params.emplace_back(given.param.id, given.text());
  record.map = map_of(c.settings).id;
  record.scene = c.scene_id;
  record.scene_key = scene_key;
  record.backend = c.backend;
  record.device = device.name;
  return record;
}

void Preparer::release() {
  for (auto& [id, state] : scenes_) state.uploaded = {};
}

Preparer::SceneState& Preparer::state_of(const SceneSpec& scene) {
  SceneState& state = scenes_[key_of(scene)];
  if (!state.uploaded.normals)
    state.uploaded = upload(context_.session.backend(), scene.scene, context_.library.heights(scene));
  return state;
}

SceneKey Preparer::key_of(const SceneSpec& scene) const {
  return scene_key(context_.library.loaded(scene).sha256, scene.scene);
}

PreparedCase Preparer::attempt(const Case& c, const SceneSpec& scene,
                               const std::function<void(PreparedCase&, SceneState&)>& rest) {
  PreparedCase prepared{.spec = &c, .record = blank_record(c, key_of(scene), context_.session.device())};
  Status on_failure = Status::unsupported;
  try {
    if (const std::string reason = conflict(c.settings, scene.scene, is_solid(scene.heightmap)); !reason.empty())
      fail_input("{}", reason);
    SceneState& state = state_of(scene);
    upload_and_draw(prepared, scene, state, on_failure);
    if (prepared.record.status == Status::ok) rest(prepared, state);
  } catch (...) {
    enter_failure(prepared.record, on_failure);
  }
  if (prepared.record.status != Status::ok) prepared.release();
  return prepared;
}

PreparedCase Preparer::prepare_to_time(const Case& c, const SceneSpec& scene) {
  return attempt(c, scene, [](PreparedCase&, SceneState&) {});
}

PreparedCase Preparer::prepare(const Case& c, const SceneSpec& scene) {
  return attempt(c, scene, [&](PreparedCase& drawn, SceneState& state) { judge_drawn(drawn, scene, state); });
}

void Preparer::upload_and_draw(PreparedCase& prepared, const SceneSpec& scene, const SceneState& state,
                               Status& on_failure) {
  Session& session = context_.session;
  const Settings& settings = prepared.spec->settings;
  Record& record = prepared.record;
  std::optional<MapTextures> textures;
  if (settings.technique().reads_map()) {
    const BakedMap& map = context_.library.map(settings, scene);
    const double start_ns = steady_ns();
    textures = context_.split.book(Part::bake, [&] { return pack(settings, map, scene.scene); });
    record.bake_time_ns = map.bake_time_ns + steady_ns() - start_ns;
    record.bake_key = map.key;
    record.memory_bytes = static_cast<std::int64_t>(textures->bytes());
  }
  prepared.frame = upload(session.backend(), textures, state.uploaded);

  on_failure = Status::compile_error;
  Compiled& shade = session.pipeline(settings, shade_target(settings, scene.scene), scene.scene);
  prepared.draws = shaded_draws(session, settings, scene.scene, prepared.frame.draw);
  // Drivers compile as late as the first draw, once more for each texture format.
  const double draw_ns = context_.split.book(
      Part::compile, [&] { return session.backend().render(prepared.draws, 1, Timer::fenced_wall).wall_ns; });
  if (shade.first_draw_ns == 0) shade.first_draw_ns = shade.compile_ns + draw_ns;
  if (!shade.pipeline->is_from_cache) record.first_draw_ns = shade.first_draw_ns;
  const DeviceInfo& device = session.device();
  record.timing_key = stage_key({bake_stage(record.map), "encode", "pack", "trace", "harness"},
                                {record.scene_key.hex, setting_id(settings), shade.spirv_sha256,
                                 session.sampler_key(settings), device.backend, device.name, device.driver});
  if (draw_ns > context_.timeout_s * 1e9) {
    record.status = Status::timeout;
    record.reason =
        fmt::format("the first frame took {:.1f} s, more than timeout_s = {}", draw_ns * 1e-9, context_.timeout_s);
  }
}

void Preparer::judge_drawn(PreparedCase& prepared, const SceneSpec& scene, SceneState& state) {
  WallSplit& split = context_.split;
  const Settings& settings = prepared.spec->settings;
  split.book(Part::draw, [&] { read_picture(context_.session, settings, scene.scene, prepared.frame.draw, picture_); });
  const Traced traced = trace_case(settings, scene, state, prepared.frame.draw);
  const Reference& seen = seen_reference(traced, scene, state);
  JudgedFrame judged = split.book(Part::judge, [&] {
    JudgedFrame frame = judge_traced(traced, state.uploaded);
    judge_pictures({.reference = seen.picture,
                    .test = picture_,
                    .width = scene.scene.width_px,
                    .height = scene.scene.height_px,
                    .reference_features = &seen.seen},
                   frame.mask, frame.score);
    return frame;
  });
  if (prepared.record.reason = blank_fault(judged.score); !prepared.record.reason.empty()) {
    prepared.record.status = Status::unsupported;
    return;
  }
  judge_motion(prepared, scene, state).fill_in(judged.score);
  prepared.record.error = judged.score;
  prepared.record.reference_key = traced.reference.key;
}

void Preparer::trace(std::span<const Draw> score_frame, std::span<const PixelFeature> features) {
  context_.split.book(Part::draw, [&] {
    trace_frame(context_.session.backend(), score_frame, pixels_);
    values_ = context_.session.backend().read_values(features);
  });
}

Preparer::Traced Preparer::trace_case(const Settings& settings, const SceneSpec& scene, SceneState& state,
                                      const Draw& relief) {
  std::vector<Draw> score_frame = scored_draws(context_.session, settings, scene.scene, relief);
  std::vector<PixelFeature> features = pixel_features(settings);
  trace(score_frame, features);
  const Reference& reference = reference_of_traced(score_frame, scene, state, features);
  return {.score_frame = std::move(score_frame), .features = std::move(features), .reference = reference};
}

JudgedFrame Preparer::judge_traced(const Traced& traced, const UploadedScene& scene) const {
  JudgedFrame judged = judge(scene.frame, scene.wrap, scene.is_solid, pixels_, traced.reference.hits);
  judge_features(traced.features, values_, traced.reference.values, judged.pixels, judged.score);
  return judged;
}

FrameScore Preparer::score(const Case& c, const SceneSpec& scene) {
  const auto make = [&] {
    SceneState& state = state_of(scene);
    const Frame frame = upload(context_.session.backend(), context_.library.packed(c.settings, scene), state.uploaded);
    const Traced traced = trace_case(c.settings, scene, state, frame.draw);
    return context_.split.book(Part::judge, [&] { return judge_traced(traced, state.uploaded).score; });
  };
  FrameScore score = cached(context_.cache, score_key(c, scene), score_codec(), make).value;
  if (const std::string fault = blank_fault(score); !fault.empty()) fail_input("{}", fault);
  return score;
}

CasePictures Preparer::pictures(const Case& c, const SceneSpec& scene) {
  Session& session = context_.session;
  SceneState& state = state_of(scene);
  const Frame frame = upload(session.backend(), context_.library.packed(c.settings, scene), state.uploaded);
  const Traced traced = trace_case(c.settings, scene, state, frame.draw);
  const Reference& seen = seen_reference(traced, scene, state);
  return context_.split.book(Part::pictures, [&] {
    const int width_px = scene.scene.width_px;
    const int height_px = scene.scene.height_px;
    const PixelScores scores = judge_pixels(state.uploaded.frame, scene.scene.wrap, pixels_, traced.reference.hits);
    CasePictures pictures{.error = heat_map(scores, width_px, height_px),
                          .taps = taps_map(pixels_, width_px, height_px),
                          .reference = seen.picture};
    draw_picture(session, c.settings, scene.scene, frame.draw, pictures.frame);
    return pictures;
  });
}

std::string Preparer::score_key(const Case& c, const SceneSpec& scene) {
  Session& session = context_.session;
  const DeviceInfo& device = session.device();
  const std::string bake = bake_stage(map_of(c.settings).id);
  return stage_key({bake, "encode", "pack", "trace", "reference", "judge"},
                   {key_of(scene).hex, setting_id(c.settings),
                    session.pipelines().fragment_sha256(session.source_of(c.settings, Target::score, scene.scene)),
                    session.sampler_key(c.settings), device.backend, device.name, device.driver});
}

std::optional<std::vector<PixelFeature>> Preparer::seen_features_in(const Scene& scene,
                                                                    std::span<const PixelFeature> own) const {
  std::optional<std::vector<PixelFeature>> seen = context_.seen_features;
  if (!seen && picture_row(scene.reference).is_complete) seen = exact_features();
  if (!seen) return seen;
  std::erase_if(*seen, [&](const PixelFeature& one) { return !stands_on(one.feature->ground, scene.surface); });
  for (const PixelFeature& one : exact_ones(own))
    if (shows_in_objects(*one.feature)) seen->push_back(one);
  return seen;
}

const Preparer::Reference& Preparer::seen_reference(const Traced& traced, const SceneSpec& scene, SceneState& state) {
  const auto seen = seen_features_in(scene.scene, traced.features);
  return seen ? reference_of_traced(traced.score_frame, scene, state, *seen) : traced.reference;
}

const Preparer::Reference& Preparer::reference_of_traced(std::span<const Draw> score_frame, const SceneSpec& scene,
                                                         SceneState& state, std::span<const PixelFeature> features) {
  WallSplit& split = context_.split;
  Reference made;
  made.features = text_of(exact_ones(features));
  const auto known = split.book(Part::reference, [&] {
    return std::ranges::find_if(state.references, [&](const Reference& one) {
      return one.features == made.features && have_rays(pixels_, one.rays);
    });
  });
  if (known != state.references.end()) return *known;
  split.book(Part::reference, [&] {
    made.rays = rays_of(pixels_);
    made.key = reference_key(hash_of(made.rays), scene, state.uploaded.frame);
  });
  made.hits = hits_of_traced(scene, made.key, state.uploaded.frame);
  made.values = values_of_traced(scene, made.key, made.hits, features, state.uploaded.frame);
  const auto seen = seen_features_in(scene.scene, features);
  if (seen && made.features != text_of(*seen))  // nothing is compared with it
    return state.references.emplace_back(std::move(made));
  made.picture =
      reference_picture({.hits = made.hits, .features = features, .values = made.values}, score_frame, scene, state);
  split.book(Part::reference,
             [&] { made.seen = flip_features(made.picture, scene.scene.width_px, scene.scene.height_px); });
  return state.references.emplace_back(std::move(made));
}

std::vector<ReferenceHit> Preparer::hits_of_traced(const SceneSpec& scene, const std::string& key,
                                                   const FrameUniforms& frame) {
  return context_.split.book(Part::reference, [&] {
    Made<std::vector<ReferenceHit>> made = cached(context_.cache, key, hits_codec(pixels_.size()), [&] {
      return exact_hits(ReferenceTracer(context_.library.heights(scene), scene.scene.wrap), frame, scene.scene.wrap,
                        pixels_, state_of(scene).uploaded.mesh.get());
    });
    ++(made.is_new ? references_traced_ : references_from_cache_);
    return std::move(made.value);
  });
}

FeatureValues Preparer::values_of_traced(const SceneSpec& scene, const std::string& reference_key,
                                         const std::vector<ReferenceHit>& hits, std::span<const PixelFeature> features,
                                         const FrameUniforms& frame) {
  FeatureValues values;
  if (features.empty()) return values;
  return context_.split.book(Part::reference, [&] {
    const ReferenceTracer tracer(context_.library.heights(scene), scene.scene.wrap);
    for (const PixelFeature& one : features) {
      const PixelValue& value = *one.feature->value;
      const std::string key =
          stage_key({"reference"}, {reference_key, one.feature->id, fmt::format("{}", value.version),
                                    sha256(std::as_bytes(std::span(&frame, 1)))});
      const auto make = [&] { return value.exact(tracer, frame, rays_of(pixels_), hits); };
      values.push_back(cached(context_.cache, key, values_codec(pixels_.size()), make).value);
    }
    return std::move(values);
  });
}

std::string Preparer::reference_key(const std::string& rays_hash, const SceneSpec& scene, const FrameUniforms& frame) {
  // On a curved surface rays are the camera's, in the world.
  const std::string rays =
      is_curved(scene.scene.surface.kind)
          ? fmt::format("{} {} {}{}", rays_hash, kSurfaceVersion, sha256(std::as_bytes(std::span(&frame, 1))),
                        mesh_text(scene.scene.surface))
          : rays_hash;
  return stage_key({"reference"}, {context_.library.loaded(scene).sha256, rays, wrap_id(scene.scene.wrap)});
}

Preparer::MovedFrame Preparer::moved_frame(const PreparedCase& prepared, const SceneSpec& scene,
                                           const SceneState& state, std::span<const PixelFeature> features, int index) {
  const auto [width_px, height_px, map_width, map_height] = state.uploaded.frame.sizes;
  Scene moved_scene = scene.scene;
  moved_scene.pan = kPanTexels * index / (map_width * moved_scene.tiling);
  MovedFrame moved{.frame = frame_uniforms(moved_scene, map_width, map_height)};
  Draw relief = prepared.frame.draw;
  relief.frame = moved.frame;
  const std::vector<Draw> draws = scored_draws(context_.session, prepared.spec->settings, scene.scene, relief);
  trace(draws, {});
  const std::string key = context_.split.book(
      Part::reference, [&] { return reference_key(hash_of(rays_of(pixels_)), scene, moved.frame); });
  const std::vector<ReferenceHit> hits = hits_of_traced(scene, key, moved.frame);
  moved.mask = judge_pixels(moved.frame, scene.scene.wrap, pixels_, hits);
  const FeatureValues values = values_of_traced(scene, key, hits, features, moved.frame);
  moved.reference = reference_picture({.hits = hits, .features = features, .values = values}, draws, scene, state);
  return moved;
}

MotionJudge Preparer::judge_motion(const PreparedCase& prepared, const SceneSpec& scene, SceneState& state) {
  // Values that the case does not have itself are the exact ones alone.
  const std::vector<PixelFeature> own = pixel_features(prepared.spec->settings);
  const std::vector<PixelFeature> features = seen_features_in(scene.scene, own).value_or(own);
  std::vector<MovedFrame>& frames = state.moved[text_of(exact_ones(features))];
  for (int i = static_cast<int>(frames.size()); i < context_.flicker_frames; ++i)
    frames.push_back(moved_frame(prepared, scene, state, features, i));
  MotionJudge motion;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    Draw relief = prepared.frame.draw;
    relief.frame = frames[i].frame;
    std::swap(picture_, picture_before_);
    context_.split.book(
        Part::draw, [&] { draw_picture(context_.session, prepared.spec->settings, scene.scene, relief, picture_); });
    if (i == 0) continue;
    context_.split.book(Part::judge, [&] {
      const MovedFrame& last = frames[i - 1];
      const MovedFrame& now = frames[i];
      motion.add({.picture = picture_before_, .reference = last.reference, .mask = last.mask},
                 {.picture = picture_, .reference = now.reference, .mask = now.mask});
    });
  }
  return motion;
}

std::vector<std::uint8_t> Preparer::reference_picture(const Exact& exact, std::span<const Draw> score_frame,
                                                      const SceneSpec& scene, const SceneState& state) {
  const FrameUniforms& frame = score_frame.front().frame;
  if (!picture_row(scene.scene.reference).is_supersampled) return shade_reference(exact, scene, state, frame);
  constexpr double kSide = kSubpixels;
  const Heightfield& heights = context_.library.heights(scene);
  const ReferenceTracer tracer(heights, scene.scene.wrap);
  PictureMean mean;
  std::vector<ScorePixel> pixels;
  for (int part = 0; part < kSubpixels * kSubpixels; ++part) {
    const double right = (part % kSubpixels + 0.5) / kSide - 0.5;
    const double down = (part / kSubpixels + 0.5) / kSide - 0.5;  // NOLINT(bugprone-integer-division): a row
    std::vector<Draw> draws(score_frame.begin(), score_frame.end());
    for (Draw& draw : draws) draw.frame = shifted(draw.frame, right, down);
    const FrameUniforms& part_frame = draws.front().frame;
    context_.split.book(Part::draw, [&] { trace_frame(context_.session.backend(), draws, pixels); });
    std::vector<ReferenceHit> hits;
    FeatureValues values;
    context_.split.book(Part::reference, [&] {
      hits = exact_hits(tracer, part_frame, scene.scene.wrap, pixels, state.uploaded.mesh.get());
      values = exact_values(exact.features, tracer, part_frame, rays_of(pixels), hits);
    });
    mean.add(shade_reference({.hits = hits, .features = exact.features, .values = values}, scene, state, part_frame));
  }
  std::vector<std::uint8_t> picture = shade_reference(exact, scene, state, frame);  // whose rays say what is seen
  mean.put_colors(picture);
  return picture;
}

std::vector<std::uint8_t> Preparer::shade_reference(const Exact& exact, const SceneSpec& scene, const SceneState& state,
                                                    const FrameUniforms& frame) {
  Session& session = context_.session;
  FeatureValues places;
  if (const Mesh* const mesh = state.uploaded.mesh.get(); mesh != nullptr)
    places = context_.split.book(Part::reference, [&] {
      const ReferenceTracer tracer(context_.library.heights(scene), scene.scene.wrap);
      return places_on_mesh(MeshFrame(tracer, *mesh, frame), frame, exact.hits);
    });
  return context_.split.book(Part::draw, [&] {
    const std::unique_ptr<Texture> texture =
        upload_exact(session.backend(), exact.hits, state.uploaded.mesh ? places : exact.values, frame);
    const Draw draw = reference_draw(state.uploaded, *texture, frame);
    return shade_frame(session.backend(), exact_draws(session, exact.features, scene.scene, draw));
  });
}

}  // namespace reliefbench
