#include "kernels/base/parallel.h"

#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>

namespace reliefbench {

void parallel_for(int count, int threads, const std::function<void(int)>& body) {
  if (threads == 1) {
    for (int i = 0; i < count; ++i) body(i);
    return;
  }
  const int cores = tbb::info::default_concurrency();
  tbb::task_arena arena(threads > 0 ? std::min(threads, cores) : cores);
  arena.execute([&] { tbb::parallel_for(0, count, body); });
}

}  // namespace reliefbench
