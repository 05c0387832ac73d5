#pragma once
#include <cstddef>

namespace reliefbench {

/// Has the cache line fetched that is so many bytes behind an address; nothing need be there. Processors fetch ahead by
/// themselves what is read in order, but not into the next page or the next line of a tile.
inline void prefetch(const void* at, std::size_t bytes) { __builtin_prefetch(static_cast<const char*>(at) + bytes); }

/// Of `size` bytes, the same.
inline void prefetch_all(const void* at, std::size_t bytes, std::size_t size) {
  constexpr std::size_t kCacheLine = 64;
  for (std::size_t i = 0; i < size; i += kCacheLine) prefetch(at, bytes + i);
}

inline constexpr std::size_t kBytesAhead = 2048;  ///< of what is read in order: half a page

}  // namespace reliefbench
