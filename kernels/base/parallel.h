#pragma once
#include <functional>

namespace reliefbench {

/// Runs body(i) for i in [0, count) on `threads` threads (0, or more than it has: as many as the machine has), in any
/// order. An exception of a body is rethrown here.
void parallel_for(int count, int threads, const std::function<void(int)>& body);

}  // namespace reliefbench
