#include "tuner/measure/prepare.h"

#include <fmt/format.h>

#include <chrono>
#include <new>
#include <optional>

#include "kernels/base/file_error.h"
#include "kernels/base/sha256.h"
#include "kernels/image/image.h"
#include "kernels/judge/heat_map.h"
#include "kernels/judge/score.h"
#include "tuner/measure/cached_values.h"
#include "tuner/plan/setting_space.h"
#include "tuner/results/run_files.h"
#include "tuner/results/stages.h"

namespace reliefbench {
namespace {

constexpr double kPanTexels = 0.25;  // of the moving camera, a frame

template <typename T>
std::string hash_of(const std::vector<T>& values) {
  return sha256(std::as_bytes(std::span(values)));
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

void PreparedCase::release() {
  draw = {};
  relief = nullptr;
  extra = nullptr;
}

void Preparer::release() {
  for (auto& [id, state] : scenes_) state.normals = nullptr;
}

Preparer::SceneState& Preparer::state_of(const SceneSpec& scene) {
  SceneState& state = scenes_[key_of(scene)];
  if (state.normals) return state;
  const Heightfield& heights = context_.library.heights(scene);
  const std::vector<std::uint8_t> normals = normal_map(heights, scene.scene.wrap, scene.scene.relief_depth);
  state.frame = frame_uniforms(scene.scene, heights.width, heights.height);
  state.normals = context_.session.backend().upload({.width = heights.width,
                                                     .height = heights.height,
                                                     .texels = std::as_bytes(std::span(normals)),
                                                     .wrap = scene.scene.wrap});
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
    SceneState& state = state_of(scene);
    upload_and_draw(prepared, scene, state, on_failure);
    if (prepared.record.status == Status::ok) rest(prepared, state);
  } catch (const FileError&) {  // a full disk ends the run: it says nothing about the case
    throw;
  } catch (const Error& error) {
    prepared.record.status = status_of(error.fault(), on_failure);
    prepared.record.reason = error.what();
  } catch (const std::bad_alloc&) {
    prepared.record.status = Status::out_of_memory;
    prepared.record.reason = "the host's memory is used up";
  }
  if (prepared.record.status != Status::ok) prepared.release();
  return prepared;
}

PreparedCase Preparer::prepare_to_time(const Case& c, const SceneSpec& scene) {
  return attempt(c, scene, [](PreparedCase&, SceneState&) {});
}

PreparedCase Preparer::prepare(const Case& c, const SceneSpec& scene) {
  Pictures pictures;
  PreparedCase prepared =
      attempt(c, scene, [&](PreparedCase& drawn, SceneState& state) { pictures = score(drawn, scene, state); });
  // Outside the case's own failures: a full disk ends the sweep.
  if (!pictures.frame.empty()) {
    context_.split.book(Part::score, [&] {
      const auto write = [&](const char* kind, const std::vector<std::uint8_t>& rgba8) {
        write_png(context_.folder / image_path(prepared.record.case_id, kind), scene.scene.width_px,
                  scene.scene.height_px, rgba8);
      };
      write("frame", pictures.frame);
      write("error", pictures.error);
    });
  }
  return prepared;
}

void Preparer::upload(PreparedCase& prepared, const SceneSpec& scene, const SceneState& state) {
  Session& session = context_.session;
  const Settings& settings = prepared.spec->settings;
  const Texture* const normals = state.normals.get();  // any texture where there is no such map
  prepared.draw = {.textures = {{kReliefMap, normals}, {kNormalMap, normals}, {kExtraMap, normals}},
                   .frame = state.frame};
  if (settings.technique().reads_map()) {
    const BakedMap& map = context_.library.map(*prepared.spec, scene);
    const MapTextures textures = map_textures(settings, map, scene.scene.wrap, scene.scene.relief_depth);
    prepared.relief = session.backend().upload(texture_desc(textures.relief, scene.scene.wrap));
    prepared.draw.textures[kReliefMap] = prepared.relief.get();
    if (textures.extra) {
      prepared.extra = session.backend().upload(texture_desc(*textures.extra, scene.scene.wrap));
      prepared.draw.textures[kExtraMap] = prepared.extra.get();
    }
    prepared.record.memory_bytes = static_cast<std::int64_t>(textures.bytes());
    prepared.record.bake_time_ns = map.bake_time_ns;
    prepared.record.bake_key = map.key;
  }
}

void Preparer::upload_and_draw(PreparedCase& prepared, const SceneSpec& scene, const SceneState& state,
                               Status& on_failure) {
  Session& session = context_.session;
  const Settings& settings = prepared.spec->settings;
  upload(prepared, scene, state);

  on_failure = Status::compile_error;
  Session::Compiled& shade = session.pipeline(settings.technique().id, &settings, Target::color, scene.scene.wrap);
  prepared.draw.pipeline = shade.pipeline.get();
  // Drivers compile as late as the first draw, once more for each texture format.
  const double draw_ns = context_.split.book(
      Part::compile, [&] { return session.backend().render(prepared.draw, 1, Timer::fenced_wall).wall_ns; });
  if (shade.first_draw_ns == 0) shade.first_draw_ns = shade.compile_ns + draw_ns;
  prepared.record.first_draw_ns = shade.first_draw_ns;
  const DeviceInfo& device = session.device();
  prepared.record.timing_key = stage_key({bake_stage(prepared.record.map), "encode", "pack", "trace", "harness"},
                                         {prepared.record.scene_key.hex, setting_id(settings), shade.spirv_sha256,
                                          device.backend, device.name, device.driver});
  if (draw_ns > context_.timeout_s * 1e9) {
    prepared.record.status = Status::timeout;
    prepared.record.reason =
        fmt::format("the first frame took {:.1f} s, more than timeout_s = {}", draw_ns * 1e-9, context_.timeout_s);
  }
}

Preparer::Pictures Preparer::score(PreparedCase& prepared, const SceneSpec& scene, SceneState& state) {
  Session& session = context_.session;
  WallSplit& split = context_.split;
  const Settings& settings = prepared.spec->settings;

  std::vector<std::uint8_t> frame = split.book(Part::score, [&] { return session.backend().read_color(); });
  Draw draw = prepared.draw;
  draw.pipeline = session.pipeline(settings.technique().id, &settings, Target::score, scene.scene.wrap).pipeline.get();
  const std::vector<ScorePixel> pixels = score_frame(draw);
  const Reference& reference = reference_of(pixels, scene, state);
  const MotionJudge motion = judge_motion(prepared, draw, scene, state);
  return split.book(Part::score, [&] {
    JudgedFrame judged = judge_frame(pixels, reference.hits, state.frame.sizes[2], state.frame.sizes[3]);
    judge_pictures(
        {.reference = reference.frame, .test = frame, .width = scene.scene.width_px, .height = scene.scene.height_px},
        judged.pixels, judged.score);
    motion.fill_in(judged.score);
    prepared.record.error = judged.score;
    prepared.record.reference_key = reference.key;
    return Pictures{.frame = std::move(frame),
                    .error = heat_map(judged.pixels, scene.scene.width_px, scene.scene.height_px)};
  });
}

std::vector<ScorePixel> Preparer::score_frame(const Draw& draw) {
  return context_.split.book(Part::score, [&] {
    context_.session.backend().render(draw, 1, Timer::fenced_wall);
    return context_.session.backend().read_score();
  });
}

FrameScore Preparer::judge(const Case& c, const SceneSpec& scene) {
  const std::string key = judge_key(c, scene);
  if (const auto bytes = context_.cache.get(key))
    if (const std::optional<FrameScore> known = read_score(*bytes)) return *known;
  SceneState& state = state_of(scene);
  PreparedCase prepared{.spec = &c, .record = blank_record(c, key_of(scene), context_.session.device())};
  upload(prepared, scene, state);
  const std::string_view source = c.settings.technique().id;
  prepared.draw.pipeline =
      context_.session.pipeline(source, &c.settings, Target::score, scene.scene.wrap).pipeline.get();
  const std::vector<ScorePixel> pixels = score_frame(prepared.draw);
  const Reference& reference = reference_of(pixels, scene, state);
  const FrameScore score = context_.split.book(Part::score, [&] {
    return judge_frame(pixels, reference.hits, state.frame.sizes[2], state.frame.sizes[3]).score;
  });
  context_.cache.put(key, score_bytes(score));
  return score;
}

std::string Preparer::judge_key(const Case& c, const SceneSpec& scene) {
  const DeviceInfo& device = context_.session.device();
  const std::string bake = bake_stage(map_of(c.settings).id);
  return stage_key({bake, "encode", "pack", "trace", "reference", "judge"},
                   {key_of(scene).hex, setting_id(c.settings),
                    context_.session.fragment_sha256(c.settings.technique().id, Target::score), device.backend,
                    device.name, device.driver});
}

const Preparer::Reference& Preparer::reference_of(const std::vector<ScorePixel>& pixels, const SceneSpec& scene,
                                                  SceneState& state) {
  const std::string rays_hash = context_.split.book(Part::reference, [&] { return hash_of(rays_of(pixels)); });
  if (const auto found = state.references.find(rays_hash); found != state.references.end()) return found->second;
  Reference reference;
  reference.key = reference_key(rays_hash, scene);
  reference.hits = trace(pixels, scene, reference.key);
  reference.frame = shade_reference(reference.hits, scene, state, state.frame);
  context_.split.book(Part::score, [&] {
    write_png(context_.folder / image_path(reference_image_key(scene.id, context_.session.device().backend), "frame"),
              scene.scene.width_px, scene.scene.height_px, reference.frame);
  });
  return state.references.emplace(rays_hash, std::move(reference)).first->second;
}

std::vector<ReferenceHit> Preparer::trace(const std::vector<ScorePixel>& pixels, const SceneSpec& scene,
                                          const std::string& key) {
  return context_.split.book(Part::reference, [&] {
    if (const auto bytes = context_.cache.get(key)) {
      if (std::optional<std::vector<ReferenceHit>> known = read_hits(*bytes, pixels.size())) {
        ++references_from_cache_;
        return std::move(*known);
      }
    }
    std::vector<ReferenceHit> hits(pixels.size());
    std::vector<TextureRay> rays;
    std::vector<std::size_t> where;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      if (static_cast<PixelStatus>(pixels[i].status) == PixelStatus::no_ray) continue;
      rays.push_back(pixels[i].ray);
      where.push_back(i);
    }
    const ReferenceTracer tracer(context_.library.heights(scene), scene.scene.wrap);
    const std::vector<ReferenceHit> traced = tracer.trace(rays);
    for (std::size_t i = 0; i < traced.size(); ++i) hits[where[i]] = traced[i];
    ++references_traced_;
    context_.cache.put(key, hit_bytes(hits));
    return hits;
  });
}

std::string Preparer::reference_key(const std::string& rays_hash, const SceneSpec& scene) {
  return stage_key({"reference"}, {context_.library.loaded(scene).sha256, rays_hash,
                                   scene.scene.wrap == Wrap::repeat ? "repeat" : "clamp"});
}

Preparer::MovedFrame Preparer::moved_frame(const Draw& score_draw, const SceneSpec& scene, const SceneState& state,
                                           int index) {
  Scene moved_scene = scene.scene;
  moved_scene.pan = kPanTexels * index / (state.frame.sizes[2] * moved_scene.tiling);
  MovedFrame moved{.frame = frame_uniforms(moved_scene, state.frame.sizes[2], state.frame.sizes[3])};
  Draw draw = score_draw;
  draw.frame = moved.frame;
  context_.session.backend().render(draw, 1, Timer::fenced_wall);
  const std::vector<ScorePixel> pixels = context_.session.backend().read_score();
  const std::vector<ReferenceHit> hits = trace(pixels, scene, reference_key(hash_of(rays_of(pixels)), scene));
  moved.mask = judge_frame(pixels, hits, state.frame.sizes[2], state.frame.sizes[3]).pixels;
  moved.reference = shade_reference(hits, scene, state, moved.frame);
  return moved;
}

MotionJudge Preparer::judge_motion(const PreparedCase& prepared, const Draw& score_draw, const SceneSpec& scene,
                                   SceneState& state) {
  for (int i = static_cast<int>(state.moved.size()); i < context_.flicker_frames; ++i)
    state.moved.push_back(moved_frame(score_draw, scene, state, i));
  return context_.split.book(Part::score, [&] {
    MotionJudge judge;
    std::vector<std::uint8_t> before;
    for (std::size_t i = 0; i < state.moved.size(); ++i) {
      Draw draw = prepared.draw;
      draw.frame = state.moved[i].frame;
      context_.session.backend().render(draw, 1, Timer::fenced_wall);
      std::vector<std::uint8_t> picture = context_.session.backend().read_color();
      if (i > 0) {
        const MovedFrame& last = state.moved[i - 1];
        const MovedFrame& now = state.moved[i];
        judge.add({.picture = before, .reference = last.reference, .mask = last.mask},
                  {.picture = picture, .reference = now.reference, .mask = now.mask});
      }
      before = std::move(picture);
    }
    return judge;
  });
}

std::vector<std::uint8_t> Preparer::shade_reference(const std::vector<ReferenceHit>& hits, const SceneSpec& scene,
                                                    const SceneState& state, const FrameUniforms& frame) {
  Session& session = context_.session;
  std::vector<float> t;
  t.reserve(hits.size());
  for (const ReferenceHit& hit : hits) t.push_back(static_cast<float>(hit.t_enter));
  const Pipeline* pipeline = session.pipeline("reference", nullptr, Target::color, scene.scene.wrap).pipeline.get();
  return context_.split.book(Part::score, [&] {
    const std::unique_ptr<Texture> texture =
        session.backend().upload({.width = scene.scene.width_px,
                                  .height = scene.scene.height_px,
                                  .layout = {.type = TexelType::float32, .channels = 1},
                                  .texels = std::as_bytes(std::span(t)),
                                  .wrap = Wrap::clamp,
                                  .filter = Filter::nearest});
    const Draw draw{.pipeline = pipeline,
                    .textures = {{kReliefMap, state.normals.get()},
                                 {kNormalMap, state.normals.get()},
                                 {kReferenceMap, texture.get()}},
                    .frame = frame};
    session.backend().render(draw, 1, Timer::fenced_wall);
    return session.backend().read_color();
  });
}

}  // namespace reliefbench
