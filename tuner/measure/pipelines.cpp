#include "tuner/measure/pipelines.h"

#include <fmt/format.h>

#include <algorithm>
#include <new>
#include <utility>

#include "kernels/base/clock.h"
#include "kernels/base/error.h"
#include "kernels/base/parallel.h"
#include "kernels/base/sha256.h"
#include "kernels/trace/surface.h"

namespace reliefbench {
namespace {

std::string_view vertex_of(const Target& target, SurfaceKind surface) {
  if (surface_row(surface).has_mesh) return "mesh";
  // The plate of a curved surface is as far as anything may be: its depth is known to fragments alone.
  return target.has_depth && !is_curved(surface) ? "plate" : "fullscreen";
}

std::string sha256_of(const Spirv& spirv) { return sha256(std::as_bytes(std::span(spirv))); }

}  // namespace

std::string PipelineSource::fragment_key() const {
  if (is_beside) return fmt::format("{}/beside", shader);
  return fmt::format("{}{}{}{}/{}{}", shader, features.empty() ? "" : "?", text_of(features),
                     is_curved(surface) ? fmt::format(" on {}", surface_row(surface).id) : "",
                     is_score(target) ? "score" : "shade", target.by_compute ? " by compute" : "");
}

std::string PipelineSource::key() const {
  std::string key = fragment_key();
  for (const SpecConstant& constant : constants) key += fmt::format(" {}={}", constant.id, constant.value);
  if (target.has_depth) key += fmt::format(" in {} with depth", vertex);
  return key;
}

Target shade_target(const Settings& settings, const Scene& scene) {
  return color_target(pixel_features(settings), needs_depth(scene));
}

PipelineSource relief_source(const Settings& settings, Target target, const Scene& scene, const MapSampler& sampler) {
  std::vector<PixelFeature> features = frame_features(settings);
  // The score frame of what is hidden is whole.
  if (is_score(target)) target = score_target(features, scene.surface.kind == SurfaceKind::mesh);
  target.by_compute = is_by_compute(settings);
  return {.shader = settings.technique().id,
          .vertex = vertex_of(target, scene.surface.kind),
          .features = std::move(features),
          .surface = scene.surface.kind,
          .target = target,
          .constants = constants_of(&settings, scene.wrap, sampler)};
}

PipelineSource exact_source(std::span<const PixelFeature> features, const Scene& scene) {
  const Target target = color_target(features, needs_depth(scene));
  return {.shader = "reference",
          .vertex = vertex_of(target, scene.surface.kind),
          .features = exact_ones(features),
          .surface = scene.surface.kind,
          .target = target,
          .constants = constants_of(nullptr, scene.wrap)};
}

PipelineSource beside_source(std::string_view shader, std::string_view vertex) {
  return {.shader = shader, .vertex = vertex, .is_beside = true, .target = color_target({}, true)};
}

void Pipelines::drop_old(std::size_t most) {
  if (pipelines_.size() <= most) return;
  if (most == 0) return pipelines_.clear();
  std::vector<std::int64_t> uses;
  uses.reserve(pipelines_.size());
  for (const auto& [key, compiled] : pipelines_) uses.push_back(compiled.last_use);
  const auto oldest_kept = uses.end() - static_cast<std::ptrdiff_t>(most);
  std::ranges::nth_element(uses, oldest_kept);
  std::erase_if(pipelines_, [&](const auto& one) { return one.second.last_use < *oldest_kept; });
}

const Spirv& Pipelines::vertex(std::string_view name) {
  auto found = vertices_.find(name);
  if (found == vertices_.end()) found = vertices_.emplace(name, compile_vertex(dialect_, name)).first;
  return found->second;
}

const Spirv& Pipelines::fragment(const PipelineSource& source) {
  std::string key = source.fragment_key();
  auto found = fragments_.find(key);
  if (found == fragments_.end()) {
    Spirv spirv = source.is_beside
                      ? compile_beside(source.shader, dialect_)
                      : compile_fragment(source.shader, source.target, dialect_, source.features, source.surface);
    found = fragments_.emplace(std::move(key), std::move(spirv)).first;
  }
  return found->second;
}

std::string Pipelines::fragment_sha256(const PipelineSource& source) { return sha256_of(fragment(source)); }

Pipelines::Stages Pipelines::stages_of(const PipelineSource& source) {
  return {.vertex = &vertex(source.vertex), .fragment = &fragment(source)};
}

Compiled Pipelines::compile(const PipelineSource& source, const Stages& stages) const {
  const double start_ns = steady_ns();
  Compiled compiled;
  compiled.pipeline = backend_->compile({.label = std::string(source.shader),
                                         .vertex = *stages.vertex,
                                         .fragment = *stages.fragment,
                                         .constants = source.constants,
                                         .target = source.target});
  compiled.compile_ns = steady_ns() - start_ns - compiled.pipeline->keeping_ns;
  compiled.spirv_sha256 = sha256_of(*stages.fragment);
  return compiled;
}

Compiled& Pipelines::keep(std::string key, Compiled compiled) {
  ++(compiled.pipeline->is_from_cache ? count_cached_ : count_compiled_);
  return pipelines_.emplace(std::move(key), std::move(compiled)).first->second;
}

Compiled& Pipelines::get(const PipelineSource& source) {
  std::string key = source.key();
  const auto found = pipelines_.find(key);
  Compiled& compiled = found != pipelines_.end() ? found->second : split_.book(Part::compile, [&]() -> Compiled& {
    return keep(std::move(key), compile(source, stages_of(source)));
  });
  compiled.last_use = ++uses_;
  return compiled;
}

void Pipelines::compile_ahead(std::span<const PipelineSource> wanted) {
  if (!backend_->device().compiles_in_parallel) return;
  split_.book(Part::compile, [&] {
    // What fails comes again, in the case that asks for it.
    const auto try_to = [](const auto& work) {
      try {
        work();
      } catch (const Error&) {
      } catch (const std::bad_alloc&) {
      }
    };
    struct Missing {
      const PipelineSource* source;
      Stages stages;
      Compiled compiled{};
    };
    std::map<std::string, Missing> missing;
    for (const PipelineSource& source : wanted)
      if (std::string key = source.key(); !pipelines_.contains(key) && !missing.contains(key))
        try_to([&] { missing.emplace(std::move(key), Missing{.source = &source, .stages = stages_of(source)}); });
    std::vector<Missing*> in_turn;
    in_turn.reserve(missing.size());
    for (auto& [key, one] : missing) in_turn.push_back(&one);
    parallel_for(static_cast<int>(in_turn.size()), 0, [&](int index) {
      Missing& one = *in_turn[static_cast<std::size_t>(index)];
      try_to([&] { one.compiled = compile(*one.source, one.stages); });
    });
    for (auto& [key, one] : missing)
      if (one.compiled.pipeline) keep(key, std::move(one.compiled));
  });
}

}  // namespace reliefbench
