#include "tuner/measure/bake_job.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <utility>

#include "backends/gpu_bake.h"
#include "kernels/base/clock.h"
#include "kernels/base/error.h"
#include "kernels/image/ktx2.h"
#include "kernels/maps/map_file.h"
#include "kernels/trace/storage_params.h"
#include "kernels/trace/technique.h"
#include "tuner/results/host.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

double median_wall_ns(std::span<const BakeTime> times) {
  std::vector<double> wall_ns(times.size());
  std::ranges::transform(times, wall_ns.begin(), &BakeTime::wall_ns);
  return median(wall_ns);
}

/// Part by part.
std::vector<ComputeTime> median_parts(std::span<const BakeTime> times) {
  if (times.empty()) return {};
  std::vector<ComputeTime> medians = times.front().parts;
  for (std::size_t i = 0; i < medians.size(); ++i) {
    std::vector<double> ns(times.size());
    std::ranges::transform(times, ns.begin(), [i](const BakeTime& one) { return one.parts[i].ns; });
    medians[i].ns = median(ns);
  }
  return medians;
}

/// What bakes on a device, which is opened, its shaders compiled, before any time is taken.
class OpenBaker {
 public:
  explicit OpenBaker(const BakeJob& job) {
    if (job.device == "cpu") return;
    const MapRow& map = job.spec.storage.map;
    if (!has_gpu_baker(map.kind)) fail_environment("no GPU baker for {} on {}", map.id, job.device);
    const BackendRow& row = find_backend(job.device);
    backend_ = job.open(row, job.device_index);
    backend_->set_render_limit(
        job.timeout_s.value_or(backend_->device().software ? kSoftwareBandLimit_s : kBandLimit_s));
    baker_.emplace(*backend_, row.dialect, map.kind,
                   BakePacking{.format = job.spec.storage.format, .encoding = job.spec.storage.encoding});
    dialect_ = row.dialect;
  }
  [[nodiscard]] std::optional<DeviceInfo> device() const {
    return backend_ ? std::optional(backend_->device()) : std::nullopt;
  }
  /// After the bakes, which a device that fails is to fail in.
  [[nodiscard]] std::optional<TimerAudit> audited_clock() const {
    return backend_ ? audit_part_clock(*backend_, dialect_) : std::nullopt;
  }
  [[nodiscard]] bool is_hardware() const { return backend_ && !backend_->device().software; }
  [[nodiscard]] GpuBake bake(const MapRow& map, const BakeRequest& request) const {
    return baker_ ? baker_->bake(request) : GpuBake{.values = map.bake(request)};
  }

 private:
  std::unique_ptr<Backend> backend_;
  Dialect dialect_{};
  std::optional<GpuBaker> baker_;
};

/// made: but for the values; nothing where the map needs no bake
BakedMap bake_by(const OpenBaker& baker, const BakeJob& job, const Heightfield& heights, RepeatedBake& made) {
  return bake(job.spec, heights, [&](const MapRow& map, const BakeRequest& request, const std::string&) {
    const bool is_hardware = baker.is_hardware();
    made = bake_repeatedly([&] { return baker.bake(map, request); },
                           job.repeat.value_or(is_hardware ? kHardwareBakes : 1), is_hardware);
    return BakedValues{.time_ns = median_wall_ns(made.times), .values = std::move(made.values)};
  });
}

void check(const BakeJob& job) {
  if (const std::string reason = conflict(job.spec.storage); !reason.empty()) fail_input("{}", reason);
  if (job.verify && !can_be_verified(job.spec.storage.map))
    fail_input("a {} map has no cones to verify", job.spec.storage.map.id);
  if (job.output.empty()) return;
  if (const std::string reason = file_conflict(job.output, job.spec.storage); !reason.empty()) fail_input("{}", reason);
}

/// Mean and share of zeros over the ratios that the map fills.
void count_ratios(const BakeJob& job, const MapTextures& textures, BakeResult& result) {
  const MapStorage& storage = job.spec.storage;
  if (storage.map.ratios == 0) return;
  const auto stored = static_cast<std::size_t>(storage.format.ratios() - (storage.map.is_solid ? 1 : 0));
  const auto filled = static_cast<std::size_t>(storage.map.ratios);
  double sum = 0;
  double closed = 0;
  double count = 0;
  for (const MapTextures& layer : cone_layers(storage.map, textures, job.spec.parameters)) {
    const std::vector<float> ratios = unpack_map(layer, storage.format, storage.encoding, storage.map.is_solid).ratios;
    for (std::size_t i = 0; i < ratios.size(); ++i) {
      if (i % stored >= filled) continue;
      sum += ratios[i];
      closed += ratios[i] == 0 ? 1 : 0;
      count += 1;
    }
  }
  result.mean_ratio = sum / count;
  result.closed_share = closed / count;
}

void write(const BakeJob& job, const MapTextures& textures, BakeResult& result) {
  result.files = write_map(job.output, job.spec.storage, textures, map_metadata(job.spec));
  if (job.output.extension() != ".ktx2") return;
  for (const std::filesystem::path& file : result.files) {
    const TextureImage& written = file == result.files.front() ? textures.relief : *textures.extra;
    if (read_ktx2(file).image.texels != written.texels) fail_environment("{}: reads back differently", file.string());
  }
}

}  // namespace

Correction default_correction(const MapRow& map) {
  for (const Technique& technique : techniques())
    if (technique.maps.front() == map.kind && technique.reads_map()) return storage_of(Settings(technique)).correction;
  return map.corrections.front();
}

const Format& default_format(const MapRow& map, const Encoding& encoding, Correction correction, float max_ratio) {
  std::string first_reason;
  for (const Format& format : formats()) {
    if (format.type != TexelType::unorm16 && format.type != TexelType::float16) continue;
    const std::string reason = conflict(
        {.map = map, .format = format, .encoding = encoding, .correction = correction, .max_ratio = max_ratio});
    if (reason.empty()) return format;
    if (first_reason.empty()) first_reason = reason;
  }
  fail_input("{}", first_reason);
}

std::map<std::string, std::string> map_metadata(const BakeSpec& spec) {
  const MapStorage& storage = spec.storage;
  std::map<std::string, std::string> metadata = {
      {"KTXwriter", fmt::format("reliefbench {}", version())},
      {"reliefbench.kind", std::string(storage.map.id)},
      {"reliefbench.kind_version", fmt::format("{}", storage.map.version)},
      {"reliefbench.correction", std::string(correction_id(storage.correction))},
      {"reliefbench.encoding", std::string(storage.encoding.id)},
      {"reliefbench.format", std::string(storage.format.id)},
      {"reliefbench.max_ratio", fmt::format("{}", storage.max_ratio)},
      {"reliefbench.relief_range", "0 1"},
      {"reliefbench.wrap", std::string(wrap_id(spec.wrap))}};
  // What a reader needs, as a shader does.
  for (const MapParam& param : storage.map.parameters)
    if (param.is_constant)
      metadata[fmt::format("reliefbench.{}", param.id)] = map_param(param).text(given_value(spec.parameters, param));
  return metadata;
}

BakeResult run_bake(const BakeJob& job) {
  check(job);
  const auto& [storage, wrap, parameters, threads] = job.spec;
  std::string reading;
  const Heightfield heights = load_heightmap(job.heightmap, &reading);
  RepeatedBake made;
  const OpenBaker baker(job);
  const BakedMap map = bake_by(baker, job, heights, made);
  std::optional<double> pack_time_ns;
  if (!made.textures) {
    const double start_ns = steady_ns();
    made.textures = pack_map(
        {.map = storage.map, .heights = map.heights, .values = map.values, .wrap = wrap, .parameters = parameters},
        storage.format, storage.encoding);
    pack_time_ns = steady_ns() - start_ns;
  }
  const MapTextures& textures = *made.textures;
  const std::optional<TimerAudit> clock = baker.audited_clock();
  BakeResult result{.reading = std::move(reading),
                    .width = heights.width,
                    .height = heights.height,
                    .bake_time_ns = map.bake_time_ns,
                    .pack_time_ns = pack_time_ns,
                    .device = baker.device(),
                    .device_times = clock && clock->valid ? median_parts(made.times) : std::vector<ComputeTime>(),
                    .clock = clock,
                    .bytes = textures.bytes(),
                    .verdict = {},
                    .files = {}};
  count_ratios(job, textures, result);
  if (job.verify)
    result.verdict = verify_map({.map = storage.map,
                                 .textures = textures,
                                 .format = storage.format,
                                 .encoding = storage.encoding,
                                 .correction = storage.correction,
                                 .wrap = wrap,
                                 .threads = threads,
                                 .parameters = parameters});
  if (!job.output.empty()) write(job, textures, result);
  return result;
}

}  // namespace reliefbench
