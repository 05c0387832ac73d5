#include "tuner/measure/bake.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <numeric>

#include "backends/gpu_bake.h"
#include "kernels/base/error.h"
#include "kernels/image/ktx2.h"
#include "kernels/maps/map_file.h"
#include "kernels/trace/technique.h"
#include "tuner/results/host.h"

namespace reliefbench {
namespace {

struct Baked {
  std::vector<float> values;
  double time_ns;  ///< of the bake alone: devices are opened and shaders compiled before
};

template <typename Bake>
Baked timed(const Bake& bake) {
  const auto start = std::chrono::steady_clock::now();
  std::vector<float> values = bake();
  return {.values = std::move(values),
          .time_ns = std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count()};
}

Baked bake_on_device(std::string_view device, const MapRow& map, const BakeRequest& request) {
  if (device == "cpu") return timed([&] { return map.bake(request); });
  if (std::ranges::find(gpu_bakers(), map.kind) == gpu_bakers().end())
    fail_environment("no GPU baker for {} on {}", map.id, device);
  const BackendRow& row = find_backend(device);
  const std::unique_ptr<Backend> backend = row.open(0, {});
  const GpuBaker baker(*backend, row.dialect, map.kind);
  return timed([&] { return baker.bake(request); });
}

void check(const BakeJob& job) {
  if (const std::string reason = conflict(job.storage); !reason.empty()) fail_input("{}", reason);
  if (job.verify && job.storage.map.content != MapContent::ratios)
    fail_input("a {} map has no cones to verify", job.storage.map.id);
  if (job.output.empty()) return;
  if (const std::string reason = file_conflict(job.output, job.storage); !reason.empty()) fail_input("{}", reason);
}

/// Mean and share of zeros over the ratios that the map fills.
void count_ratios(const BakeJob& job, const MapTextures& textures, BakeResult& result) {
  const MapStorage& storage = job.storage;
  if (storage.map.ratios == 0) return;
  const auto stored = static_cast<std::size_t>(storage.format.ratios());
  const auto filled = static_cast<std::size_t>(storage.map.ratios);
  const std::vector<float> ratios = unpack_map(textures, storage.format, storage.encoding).ratios;
  double sum = 0;
  double closed = 0;
  for (std::size_t i = 0; i < ratios.size(); ++i) {
    if (i % stored >= filled) continue;
    sum += ratios[i];
    closed += ratios[i] == 0 ? 1 : 0;
  }
  const std::size_t texels = ratios.size() / stored;
  const auto count = static_cast<double>(texels * filled);
  result.mean_ratio = sum / count;
  result.closed_share = closed / count;
}

void write(const BakeJob& job, const MapTextures& textures, BakeResult& result) {
  result.files = write_map(job.output, job.storage, textures, map_metadata(job.storage, job.wrap));
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

std::map<std::string, std::string> map_metadata(const MapStorage& storage, Wrap wrap) {
  return {{"KTXwriter", fmt::format("reliefbench {}", version())},
          {"reliefbench.kind", std::string(storage.map.id)},
          {"reliefbench.kind_version", fmt::format("{}", storage.map.version)},
          {"reliefbench.correction", std::string(correction_id(storage.correction))},
          {"reliefbench.encoding", std::string(storage.encoding.id)},
          {"reliefbench.format", std::string(storage.format.id)},
          {"reliefbench.max_ratio", fmt::format("{}", storage.max_ratio)},
          {"reliefbench.relief_range", "0 1"},
          {"reliefbench.wrap", wrap == Wrap::repeat ? "repeat" : "clamp"}};
}

BakeResult run_bake(const BakeJob& job) {
  check(job);
  const MapStorage& storage = job.storage;
  std::string reading;
  const Heightfield heights = quantise_heights(load_heightmap(job.heightmap, &reading), storage.format.type);
  const BakeRequest request{.heights = heights,
                            .wrap = job.wrap,
                            .correction = storage.correction,
                            .max_ratio = storage.max_ratio,
                            .parameters = job.parameters,
                            .threads = job.threads};
  BakeResult result{
      .reading = std::move(reading), .width = heights.width, .height = heights.height, .verdict = {}, .files = {}};
  const Baked baked = bake_on_device(job.device, storage.map, request);
  result.bake_time_ns = baked.time_ns;
  const MapTextures textures =
      pack_map({.map = storage.map, .heights = heights, .values = baked.values, .wrap = job.wrap}, storage.format,
               storage.encoding);
  result.bytes = textures.bytes();
  count_ratios(job, textures, result);
  if (job.verify)
    result.verdict = verify_map({.map = storage.map,
                                 .textures = textures,
                                 .format = storage.format,
                                 .encoding = storage.encoding,
                                 .correction = storage.correction,
                                 .wrap = job.wrap,
                                 .threads = job.threads});
  if (!job.output.empty()) write(job, textures, result);
  return result;
}

}  // namespace reliefbench
