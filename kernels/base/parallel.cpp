#include "kernels/base/parallel.h"

#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>

namespace reliefbench {
namespace {

constexpr std::size_t kShare = 1U << 16U;

}  // namespace

void parallel_for(int count, int threads, const std::function<void(int)>& body) {
  if (threads == 1) {
    for (int i = 0; i < count; ++i) body(i);
    return;
  }
  const int cores = tbb::info::default_concurrency();
  tbb::task_arena arena(threads > 0 ? std::min(threads, cores) : cores);
  arena.execute([&] { tbb::parallel_for(0, count, body); });
}

std::size_t share_count(std::size_t count) { return (count + kShare - 1) / kShare; }

void for_each_share(std::size_t count, const std::function<void(std::size_t, std::size_t, std::size_t)>& work) {
  parallel_for(static_cast<int>(share_count(count)), 0, [&](int task) {
    const auto share = static_cast<std::size_t>(task);
    work(share, share * kShare, std::min(kShare, count - share * kShare));
  });
}

}  // namespace reliefbench
