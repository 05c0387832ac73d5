#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "backends/backend.h"
#include "kernels/base/cache.h"

namespace reliefbench {

/// What a driver made of pipelines, kept in the user's Cache so that no later process compiles them again: a file each,
/// by the driver and by what the pipeline is made of. The files are checked, written whole, and trimmed with all others
/// of the cache, so that any number of processes may share them.
class PipelineCache {
 public:
  /// Keeps nothing.
  PipelineCache() = default;
  /// driver: all that its bytes depend on
  explicit PipelineCache(std::string driver) : cache_(Cache::default_folder()), driver_(std::move(driver)) {}

  [[nodiscard]] bool keeps() const { return cache_.has_value(); }
  /// What a pipeline is made of, on this driver; "" where nothing is kept.
  [[nodiscard]] std::string key(const PipelineDesc& desc) const;
  [[nodiscard]] std::string key(const ComputeDesc& desc) const;
  /// The bytes that were put for a key; none: there are none, or they are damaged.
  [[nodiscard]] std::optional<std::vector<std::byte>> get(const std::string& key) const;
  void put(const std::string& key, std::span<const std::byte> made) const;

 private:
  std::optional<Cache> cache_;
  std::string driver_;
};

}  // namespace reliefbench
