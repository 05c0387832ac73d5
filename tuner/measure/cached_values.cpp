#include "tuner/measure/cached_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "kernels/base/error.h"
#include "kernels/judge/metric.h"
#include "kernels/maps/distance_map.h"
#include "kernels/maps/omni_table.h"
#include "kernels/maps/sector_map.h"

namespace reliefbench {
namespace {

static_assert(std::endian::native == std::endian::little);

// The layouts' versions; what stands in them is versioned by the key (tuner/results/stages.h).
constexpr std::string_view kBake = "bake 1";
constexpr std::string_view kHits = "hits 1";
constexpr std::string_view kValues = "values 1";
constexpr std::string_view kScore = "score 2";
constexpr const char* kPixels = "pixels";

template <typename Number>
std::vector<std::byte> bytes_of(const std::string& head, std::span<const Number> numbers) {
  std::vector<std::byte> bytes(head.size() + numbers.size_bytes());
  std::ranges::copy(std::as_bytes(std::span(head)), bytes.begin());
  std::ranges::copy(std::as_bytes(numbers), bytes.begin() + static_cast<std::ptrdiff_t>(head.size()));
  return bytes;
}

std::string head_of(std::string_view kind, std::size_t numbers) { return fmt::format("{} {}\n", kind, numbers); }

/// Just `count` numbers behind their head.
template <typename Number>
std::optional<std::vector<Number>> numbers_of(std::span<const std::byte> bytes, std::string_view kind,
                                              std::size_t count) {
  const std::string head = head_of(kind, count);
  if (bytes.size() != head.size() + count * sizeof(Number)) return std::nullopt;
  if (!std::ranges::equal(bytes.first(head.size()), std::as_bytes(std::span(head)))) return std::nullopt;
  std::vector<Number> numbers(count);
  std::ranges::copy(bytes.subspan(head.size()), std::as_writable_bytes(std::span(numbers)).begin());
  return numbers;
}

std::vector<std::byte> bake_bytes(const BakedValues& bake) {
  std::vector<std::byte> bytes = bytes_of(head_of(kBake, bake.values.size()), std::span<const float>(bake.values));
  const auto time = std::as_bytes(std::span(&bake.time_ns, 1));
  bytes.insert(bytes.end(), time.begin(), time.end());
  return bytes;
}

std::optional<BakedValues> read_bake(std::span<const std::byte> bytes, std::size_t values) {
  BakedValues bake;
  if (bytes.size() < sizeof(bake.time_ns)) return std::nullopt;
  const auto time = bytes.last(sizeof(bake.time_ns));
  auto numbers = numbers_of<float>(bytes.first(bytes.size() - time.size()), kBake, values);
  if (!numbers) return std::nullopt;
  std::ranges::copy(time, std::as_writable_bytes(std::span(&bake.time_ns, 1)).begin());
  bake.values = std::move(*numbers);
  return bake;
}

std::vector<std::byte> hit_bytes(std::span<const ReferenceHit> hits) {
  std::vector<double> numbers;
  numbers.reserve(2 * hits.size());
  for (const ReferenceHit& hit : hits) numbers.insert(numbers.end(), {hit.t_enter, hit.t_exit});
  return bytes_of(head_of(kHits, numbers.size()), std::span<const double>(numbers));
}

std::optional<std::vector<ReferenceHit>> read_hits(std::span<const std::byte> bytes, std::size_t hits) {
  const auto numbers = numbers_of<double>(bytes, kHits, 2 * hits);
  if (!numbers) return std::nullopt;
  std::vector<ReferenceHit> read(hits);
  for (std::size_t i = 0; i < hits; ++i) read[i] = {.t_enter = (*numbers)[2 * i], .t_exit = (*numbers)[2 * i + 1]};
  return read;
}

std::vector<std::byte> score_bytes(const FrameScore& score) {
  nlohmann::json values = {{kPixels, score.pixels}};  // what was not judged is absent
  for (const MetricRow& row : metrics())
    if (const std::optional<double> value = row.value(score)) values[std::string(row.id)] = *value;
  const std::string text = values.dump();
  return bytes_of(head_of(kScore, text.size()), std::span<const char>(text));
}

std::optional<FrameScore> read_score(std::span<const std::byte> bytes) {
  const auto newline = std::ranges::find(bytes, std::byte{'\n'});
  if (newline == bytes.end()) return std::nullopt;
  const auto length = static_cast<std::size_t>(bytes.end() - newline) - 1;
  const auto text = numbers_of<char>(bytes, kScore, length);
  if (!text) return std::nullopt;
  try {
    const nlohmann::json values = nlohmann::json::parse(*text);
    FrameScore score{.pixels = values.at(kPixels).get<std::int64_t>()};
    for (const MetricRow& row : metrics()) {
      const auto value = values.find(row.id);
      if (value != values.end()) score.values.at(row.place) = value->get<double>();
      // Every judged frame has those of its pixels: one that is absent is a metric newer than the entry.
      if (value == values.end() && !row.compares_pictures && row.metric->feature.empty()) return std::nullopt;
    }
    return score;
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;
  } catch (const Error&) {
    return std::nullopt;
  }
}

}  // namespace

Codec<BakedValues> bake_codec(std::size_t values) {
  return {.write = bake_bytes, .read = [values](std::span<const std::byte> bytes) { return read_bake(bytes, values); }};
}

std::size_t baked_value_count(const MapRow& map, const BakeRequest& request) {
  const Heightfield& heights = request.heights;
  const std::size_t texels = heights.texels.size();
  switch (map.content) {
    case MapContent::heights:
      return 0;
    case MapContent::ratios:
      return texels * static_cast<std::size_t>(map.ratios);
    case MapContent::sectors:
      return texels * static_cast<std::size_t>(sector_count(request.parameters));
    case MapContent::volume:
      return texels * static_cast<std::size_t>(request.value(kDistanceSlices));
    case MapContent::table: {
      const OmniTable table(request.parameters);
      return static_cast<std::size_t>(table.width()) * static_cast<std::size_t>(table.height());
    }
    case MapContent::pyramid:
      break;
  }
  std::size_t nodes = 0;
  for (int level = 0; std::max(heights.width, heights.height) >> level > 0; ++level)
    nodes += static_cast<std::size_t>(level_side(heights.width, level)) *
             static_cast<std::size_t>(level_side(heights.height, level));
  return map.is_solid ? 2 * nodes : nodes;
}

Codec<std::vector<ReferenceHit>> hits_codec(std::size_t hits) {
  return {.write = hit_bytes, .read = [hits](std::span<const std::byte> bytes) { return read_hits(bytes, hits); }};
}

Codec<std::vector<float>> values_codec(std::size_t values) {
  return {.write =
              [](const std::vector<float>& made) {
                return bytes_of(head_of(kValues, made.size()), std::span<const float>(made));
              },
          .read = [values](std::span<const std::byte> bytes) { return numbers_of<float>(bytes, kValues, values); }};
}

Codec<FrameScore> score_codec() { return {.write = score_bytes, .read = read_score}; }

}  // namespace reliefbench
