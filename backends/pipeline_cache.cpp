#include "backends/pipeline_cache.h"

#include <fmt/format.h>

#include "kernels/base/sha256.h"

namespace reliefbench {
namespace {

constexpr int kKeptVersion = 1;  // of what stands in a file

std::string sha256_of_words(std::span<const std::uint32_t> words) { return sha256(std::as_bytes(words)); }

}  // namespace

std::string PipelineCache::key(const PipelineDesc& desc) const {
  if (!keeps()) return "";
  std::string key = fmt::format("pipeline {} {} {}", kKeptVersion, driver_, sha256_of_words(desc.fragment));
  if (!desc.target.by_compute) key += " " + sha256_of_words(desc.vertex);
  for (const SpecConstant& constant : desc.constants) key += fmt::format(" {}={}", constant.id, constant.value);
  for (const Attachment& one : desc.target.attachments)
    key += fmt::format(" {} {}x{}", one.name, one.layout.channels, texel_type_id(one.layout.type));
  return key + (desc.target.has_depth ? " with depth" : "");
}

std::string PipelineCache::key(const ComputeDesc& desc) const {
  return keeps() ? fmt::format("compute {} {} {}", kKeptVersion, driver_, sha256_of_words(desc.spirv)) : "";
}

std::optional<std::vector<std::byte>> PipelineCache::get(const std::string& key) const {
  return cache_ ? cache_->get(key) : std::nullopt;
}

void PipelineCache::put(const std::string& key, std::span<const std::byte> made) const {
  if (cache_) cache_->put(key, made);
}

}  // namespace reliefbench
