#pragma once
#include <cstddef>
#include <functional>

namespace reliefbench {

/// Runs body(i) for i in [0, count) on `threads` threads (0, or more than it has: as many as the machine has), in any
/// order. An exception of a body is rethrown here.
void parallel_for(int count, int threads, const std::function<void(int)>& body);

/// The parts of [0, count) that tasks work on: one size whatever the number of threads, so that sums over them are the
/// same on every machine.
[[nodiscard]] std::size_t share_count(std::size_t count);
/// Calls work(share, first, size) for each, on all of the machine's threads, in any order.
void for_each_share(std::size_t count, const std::function<void(std::size_t, std::size_t, std::size_t)>& work);

}  // namespace reliefbench
