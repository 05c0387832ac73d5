#include "tuner/measure/prepare.h"

#include <fmt/format.h>

#include <optional>

#include "kernels/base/sha256.h"
#include "kernels/image/image.h"
#include "kernels/judge/heat_map.h"
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
  Pictures pictures;
  PreparedCase prepared =
      attempt(c, scene, [&](PreparedCase& drawn, SceneState& state) { pictures = judge_drawn(drawn, scene, state); });
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

void Preparer::upload_and_draw(PreparedCase& prepared, const SceneSpec& scene, const SceneState& state,
                               Status& on_failure) {
  Session& session = context_.session;
  const Settings& settings = prepared.spec->settings;
  Record& record = prepared.record;
  const std::optional<MapTextures> textures = context_.library.packed(settings, scene);
  prepared.frame = upload(session.backend(), textures, state.uploaded);
  if (textures) {
    const BakedMap& map = context_.library.map(settings, scene);
    record.memory_bytes = static_cast<std::int64_t>(textures->bytes());
    record.bake_time_ns = map.bake_time_ns;
    record.bake_key = map.key;
  }

  on_failure = Status::compile_error;
  Session::Compiled& shade = session.pipeline(settings, Target::color, scene.scene.wrap);
  prepared.frame.draw.pipeline = shade.pipeline.get();
  // Drivers compile as late as the first draw, once more for each texture format.
  const double draw_ns = context_.split.book(
      Part::compile, [&] { return session.backend().render(prepared.frame.draw, 1, Timer::fenced_wall).wall_ns; });
  if (shade.first_draw_ns == 0) shade.first_draw_ns = shade.compile_ns + draw_ns;
  record.first_draw_ns = shade.first_draw_ns;
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

Preparer::Pictures Preparer::judge_drawn(PreparedCase& prepared, const SceneSpec& scene, SceneState& state) {
  WallSplit& split = context_.split;
  std::vector<std::uint8_t> frame = split.book(Part::score, [&] { return context_.session.backend().read_color(); });
  const Draw draw = score_draw(prepared.spec->settings, prepared.frame, scene);
  const std::vector<ScorePixel> pixels = trace(draw);
  const Reference& reference = reference_of(pixels, scene, state);
  const MotionJudge motion = judge_motion(prepared, draw, scene, state);
  return split.book(Part::score, [&] {
    const auto [width_px, height_px, map_width, map_height] = state.uploaded.frame.sizes;
    JudgedFrame judged = judge(pixels, reference.hits, map_width, map_height);
    judge_pictures({.reference = reference.picture, .test = frame, .width = width_px, .height = height_px},
                   judged.pixels, judged.score);
    motion.fill_in(judged.score);
    prepared.record.error = judged.score;
    prepared.record.reference_key = reference.key;
    return Pictures{.frame = std::move(frame), .error = heat_map(judged.pixels, width_px, height_px)};
  });
}

Draw Preparer::score_draw(const Settings& settings, const Frame& frame, const SceneSpec& scene) {
  return frame.with(*context_.session.pipeline(settings, Target::score, scene.scene.wrap).pipeline);
}

std::vector<ScorePixel> Preparer::trace(const Draw& score_draw) {
  return context_.split.book(Part::score, [&] { return trace_frame(context_.session.backend(), score_draw); });
}

FrameScore Preparer::score(const Case& c, const SceneSpec& scene) {
  const auto make = [&] {
    SceneState& state = state_of(scene);
    const Frame frame = upload(context_.session.backend(), context_.library.packed(c.settings, scene), state.uploaded);
    const std::vector<ScorePixel> pixels = trace(score_draw(c.settings, frame, scene));
    const Reference& reference = reference_of(pixels, scene, state);
    const auto& sizes = state.uploaded.frame.sizes;
    return context_.split.book(Part::score, [&] { return judge(pixels, reference.hits, sizes[2], sizes[3]).score; });
  };
  return cached(context_.cache, score_key(c, scene), score_codec(), make).value;
}

std::string Preparer::score_key(const Case& c, const SceneSpec& scene) {
  const DeviceInfo& device = context_.session.device();
  const std::string bake = bake_stage(map_of(c.settings).id);
  return stage_key({bake, "encode", "pack", "trace", "reference", "judge"},
                   {key_of(scene).hex, setting_id(c.settings),
                    context_.session.fragment_sha256(c.settings.technique().id, Target::score),
                    context_.session.sampler_key(c.settings), device.backend, device.name, device.driver});
}

const Preparer::Reference& Preparer::reference_of(const std::vector<ScorePixel>& pixels, const SceneSpec& scene,
                                                  SceneState& state) {
  const std::string rays_hash = context_.split.book(Part::reference, [&] { return hash_of(rays_of(pixels)); });
  if (const auto found = state.references.find(rays_hash); found != state.references.end()) return found->second;
  Reference reference;
  reference.key = reference_key(rays_hash, scene);
  reference.hits = hits_of(pixels, scene, reference.key);
  reference.picture = shade_reference(reference.hits, scene, state, state.uploaded.frame);
  context_.split.book(Part::score, [&] {
    write_png(context_.folder / image_path(reference_image_key(scene.id, context_.session.device().backend), "frame"),
              scene.scene.width_px, scene.scene.height_px, reference.picture);
  });
  return state.references.emplace(rays_hash, std::move(reference)).first->second;
}

std::vector<ReferenceHit> Preparer::hits_of(const std::vector<ScorePixel>& pixels, const SceneSpec& scene,
                                            const std::string& key) {
  return context_.split.book(Part::reference, [&] {
    Made<std::vector<ReferenceHit>> made = cached(context_.cache, key, hits_codec(pixels.size()), [&] {
      return exact_hits(ReferenceTracer(context_.library.heights(scene), scene.scene.wrap), pixels);
    });
    ++(made.is_new ? references_traced_ : references_from_cache_);
    return std::move(made.value);
  });
}

std::string Preparer::reference_key(const std::string& rays_hash, const SceneSpec& scene) {
  return stage_key({"reference"}, {context_.library.loaded(scene).sha256, rays_hash,
                                   scene.scene.wrap == Wrap::repeat ? "repeat" : "clamp"});
}

Preparer::MovedFrame Preparer::moved_frame(const Draw& score_draw, const SceneSpec& scene, const SceneState& state,
                                           int index) {
  const auto [width_px, height_px, map_width, map_height] = state.uploaded.frame.sizes;
  Scene moved_scene = scene.scene;
  moved_scene.pan = kPanTexels * index / (map_width * moved_scene.tiling);
  MovedFrame moved{.frame = frame_uniforms(moved_scene, map_width, map_height)};
  Draw draw = score_draw;
  draw.frame = moved.frame;
  const std::vector<ScorePixel> pixels = trace_frame(context_.session.backend(), draw);
  const std::vector<ReferenceHit> hits = hits_of(pixels, scene, reference_key(hash_of(rays_of(pixels)), scene));
  moved.mask = judge(pixels, hits, map_width, map_height).pixels;
  moved.reference = shade_reference(hits, scene, state, moved.frame);
  return moved;
}

MotionJudge Preparer::judge_motion(const PreparedCase& prepared, const Draw& score_draw, const SceneSpec& scene,
                                   SceneState& state) {
  for (int i = static_cast<int>(state.moved.size()); i < context_.flicker_frames; ++i)
    state.moved.push_back(moved_frame(score_draw, scene, state, i));
  return context_.split.book(Part::score, [&] {
    MotionJudge motion;
    std::vector<std::uint8_t> before;
    for (std::size_t i = 0; i < state.moved.size(); ++i) {
      Draw draw = prepared.frame.draw;
      draw.frame = state.moved[i].frame;
      std::vector<std::uint8_t> picture = shade_frame(context_.session.backend(), draw);
      if (i > 0) {
        const MovedFrame& last = state.moved[i - 1];
        const MovedFrame& now = state.moved[i];
        motion.add({.picture = before, .reference = last.reference, .mask = last.mask},
                   {.picture = picture, .reference = now.reference, .mask = now.mask});
      }
      before = std::move(picture);
    }
    return motion;
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
                    .textures = {{kReliefMap, state.uploaded.normals.get()},
                                 {kNormalMap, state.uploaded.normals.get()},
                                 {kReferenceMap, texture.get()}},
                    .frame = frame};
    return shade_frame(session.backend(), draw);
  });
}

}  // namespace reliefbench
