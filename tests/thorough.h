#pragma once
#include <cstdlib>

namespace reliefbench {

/// Whether all is asked for, not a part of it.
inline bool is_thorough() {
  return std::getenv("RELIEFBENCH_THOROUGH") != nullptr;  // NOLINT(concurrency-mt-unsafe)
}

/// How often what is random, or one of many alike, is tried. Of each, `./dev test` tries enough to find a common fault;
/// RELIEFBENCH_THOROUGH=1 tries all that was promised. Under a sanitizer, where all is slow, the least does.
inline int tried([[maybe_unused]] int usually, int thoroughly, [[maybe_unused]] int sanitized) {
  if (is_thorough()) return thoroughly;
#if defined(__SANITIZE_ADDRESS__)
  return sanitized;
#else
  return usually;
#endif
}

}  // namespace reliefbench
