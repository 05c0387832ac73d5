#pragma once
#include <cstddef>
#include <cstdlib>

namespace reliefbench {

/// Whether all is asked for, not a part of it.
inline bool is_thorough() {
  return std::getenv("RELIEFBENCH_THOROUGH") != nullptr;  // NOLINT(concurrency-mt-unsafe)
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kIsSanitized = true;
#else
inline constexpr bool kIsSanitized = false;
#endif

/// How often what is random, or one of many alike, is tried. Of each, `./dev test` tries enough to find a common fault;
/// RELIEFBENCH_THOROUGH=1 tries all that was promised. Under a sanitizer, where all is slow, the least does.
inline int tried(int usually, int thoroughly, int sanitized) {
  if (is_thorough()) return thoroughly;
  return kIsSanitized ? sanitized : usually;
}

/// Of many cases alike, each is tried in one of two tests, in turn, unless told to be thorough.
inline bool is_turn(std::size_t number, bool of_first) { return is_thorough() || (number % 2 == 0) == of_first; }

}  // namespace reliefbench
