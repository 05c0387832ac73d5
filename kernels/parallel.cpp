#include "kernels/parallel.h"

#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

namespace reliefbench {

void parallel_for(int count, int threads, const std::function<void(int)>& body) {
  if (threads == 1) {
    for (int i = 0; i < count; ++i) body(i);
    return;
  }
  tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
  arena.execute([&] { tbb::parallel_for(0, count, body); });
}

}  // namespace reliefbench
