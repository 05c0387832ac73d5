#include "tuner/measure/bake_job.h"

#include <fmt/format.h>

#include <algorithm>

#include "backends/gpu_bake.h"
#include "kernels/base/error.h"
#include "kernels/image/ktx2.h"
#include "kernels/maps/map_file.h"
#include "kernels/trace/technique.h"
#include "tuner/results/host.h"

namespace reliefbench {
namespace {

/// Bakes on a device, which is opened, its shader compiled, before the time is taken.
BakedMap bake_on_device(std::string_view device, const BakeSpec& spec, const Heightfield& heights) {
  if (device == "cpu") return bake(spec, heights);
  const MapRow& map = spec.storage.map;
  if (std::ranges::find(gpu_bakers(), map.kind) == gpu_bakers().end())
    fail_environment("no GPU baker for {} on {}", map.id, device);
  const BackendRow& row = find_backend(device);
  const std::unique_ptr<Backend> backend = row.open(0, {});
  const GpuBaker baker(*backend, row.dialect, map.kind);
  return bake(spec, heights, [&](const MapRow&, const BakeRequest& request, const std::string&) {
    return timed_bake([&] { return baker.bake(request); });
  });
}

void check(const BakeJob& job) {
  if (const std::string reason = conflict(job.spec.storage); !reason.empty()) fail_input("{}", reason);
  if (job.verify && job.spec.storage.map.content != MapContent::ratios)
    fail_input("a {} map has no cones to verify", job.spec.storage.map.id);
  if (job.output.empty()) return;
  if (const std::string reason = file_conflict(job.output, job.spec.storage); !reason.empty()) fail_input("{}", reason);
}

/// Mean and share of zeros over the ratios that the map fills.
void count_ratios(const BakeJob& job, const MapTextures& textures, BakeResult& result) {
  const MapStorage& storage = job.spec.storage;
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
  result.files = write_map(job.output, job.spec.storage, textures, map_metadata(job.spec.storage, job.spec.wrap));
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
  const auto& [storage, wrap, parameters, threads] = job.spec;
  std::string reading;
  const Heightfield heights = load_heightmap(job.heightmap, &reading);
  const BakedMap map = bake_on_device(job.device, job.spec, heights);
  const MapTextures textures =
      pack_map({.map = storage.map, .heights = map.heights, .values = map.values, .wrap = wrap}, storage.format,
               storage.encoding);
  BakeResult result{.reading = std::move(reading),
                    .width = heights.width,
                    .height = heights.height,
                    .bake_time_ns = map.bake_time_ns,
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
                                 .threads = threads});
  if (!job.output.empty()) write(job, textures, result);
  return result;
}

}  // namespace reliefbench
