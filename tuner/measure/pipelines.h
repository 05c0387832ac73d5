#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "backends/backend.h"
#include "backends/shader_compiler.h"
#include "kernels/trace/technique.h"
#include "kernels/trace/view.h"
#include "tuner/measure/wall_split.h"

namespace reliefbench {

/// Pipelines that are kept of a software rasteriser, which takes two to three megabytes for each.
inline constexpr std::size_t kMostSoftwarePipelines = 1024;

/// What a pipeline is made from.
struct PipelineSource {
  std::string_view shader;  ///< the fragment shader's file
  std::string_view vertex;  ///< the vertex shader's
  bool is_beside = false;   ///< of compile_beside()
  std::vector<PixelFeature> features{};
  SurfaceKind surface = SurfaceKind::plane;
  Target target{};
  std::vector<SpecConstant> constants{};

  /// The same for those that share their SPIR-V, before it is specialised.
  [[nodiscard]] std::string fragment_key() const;
  [[nodiscard]] std::string key() const;
};
/// Of the shaded frame of a setting.
[[nodiscard]] Target shade_target(const Settings& settings, const Scene& scene);
/// Of a setting's relief. Target::score: with what the settings' features of the scene put there, too.
[[nodiscard]] PipelineSource relief_source(const Settings& settings, Target target, const Scene& scene,
                                           const MapSampler& sampler);
/// Of what shades the exact hits, with the exact values of these features.
[[nodiscard]] PipelineSource exact_source(std::span<const PixelFeature> features, const Scene& scene);
/// Of what is drawn into a frame with depth beside its relief.
[[nodiscard]] PipelineSource beside_source(std::string_view shader, std::string_view vertex);

struct Compiled {
  std::unique_ptr<Pipeline> pipeline;
  std::string spirv_sha256;
  double compile_ns = 0;      ///< without what it took to keep it in the cache
  double first_draw_ns = 0;   ///< compile and first draw; 0 until it is drawn
  std::int64_t last_use = 0;  ///< a count of uses
};

/// A device's pipelines, each compiled once. compile_ns is booked as Part::compile.
class Pipelines {
 public:
  Pipelines(Dialect dialect, WallSplit& split) : dialect_(dialect), split_(split) {}

  /// Of this device from now on. SPIR-V is kept, pipelines of another device are to be dropped while it is there.
  void set_backend(Backend& backend) { backend_ = &backend; }
  void drop_all() { pipelines_.clear(); }
  /// Lets go of those that were used longest ago, down to `most`; draws with them count no more.
  void drop_old(std::size_t most);

  /// throws: Error(environment): compiler's words
  [[nodiscard]] Compiled& get(const PipelineSource& source);
  /// Whether get() has it already.
  [[nodiscard]] bool has(const PipelineSource& source) const { return pipelines_.contains(source.key()); }
  /// Compiles what get() is going to be asked for, on all threads, where the device compiles in parallel; what fails is
  /// left for get() to meet again. compile_ns then is a pipeline's time beside others.
  void compile_ahead(std::span<const PipelineSource> wanted);

  /// By its name.
  [[nodiscard]] const Spirv& vertex(std::string_view name);
  [[nodiscard]] std::string fragment_sha256(const PipelineSource& source);
  /// How many were compiled so far.
  [[nodiscard]] int count_compiled() const { return count_compiled_; }
  /// How many came from the cache on disk instead.
  [[nodiscard]] int count_cached() const { return count_cached_; }

 private:
  struct Stages {
    const Spirv* vertex;
    const Spirv* fragment;
  };
  [[nodiscard]] Stages stages_of(const PipelineSource& source);
  [[nodiscard]] const Spirv& fragment(const PipelineSource& source);
  [[nodiscard]] Compiled compile(const PipelineSource& source, const Stages& stages) const;
  Compiled& keep(std::string key, Compiled compiled);

  Dialect dialect_;
  WallSplit& split_;
  Backend* backend_ = nullptr;
  std::map<std::string, Spirv, std::less<>> vertices_;
  std::map<std::string, Spirv, std::less<>> fragments_;
  std::map<std::string, Compiled, std::less<>> pipelines_;
  std::int64_t uses_ = 0;
  int count_compiled_ = 0;
  int count_cached_ = 0;
};

}  // namespace reliefbench
