#pragma once
#include <cstdlib>

namespace reliefbench {

/// How often what is random, or one of many alike, is tried. Of each, `./dev test` tries enough to find a common fault;
/// RELIEFBENCH_THOROUGH=1 tries all that was promised. Under a sanitizer, where all is slow, the least does.
inline int tried(int usually, int thoroughly, [[maybe_unused]] int sanitized) {
  if (std::getenv("RELIEFBENCH_THOROUGH") != nullptr) return thoroughly;  // NOLINT(concurrency-mt-unsafe)
#if defined(__SANITIZE_ADDRESS__)
  return sanitized;
#else
  return usually;
#endif
}

}  // namespace reliefbench
