#pragma once
#include <cerrno>

namespace reliefbench {

/// A system call, made again for as long as a signal interrupts it. returns: what it gives, -1 with errno on failure
template <typename Call>
auto uninterrupted(const Call& call) {
  for (;;)
    if (const auto result = call(); result != -1 || errno != EINTR) return result;
}

}  // namespace reliefbench
