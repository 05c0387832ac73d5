#include "kernels/base/parallel.h"

#if defined(__SANITIZE_THREAD__)
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>
#else
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>
#endif

#include <algorithm>

namespace reliefbench {
namespace {

constexpr std::size_t kShare = 1U << 16U;

#if defined(__SANITIZE_THREAD__)
// TBB is not compiled for ThreadSanitizer, which sees none of its order: threads of our own take its place.
void run_loop(int count, int threads, const std::function<void(int)>& body) {
  std::atomic<int> next = 0;
  std::mutex mutex;
  std::exception_ptr failed;
  const auto work = [&] {
    try {
      for (int i = next++; i < count; i = next++) body(i);
    } catch (...) {
      const std::lock_guard lock(mutex);
      failed = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> pool;  // joined also where one of them can't be started
    for (int i = 0; i < std::min(count, threads > 0 ? threads : 4); ++i) pool.emplace_back(work);
  }
  if (failed) std::rethrow_exception(failed);
}
#else
void run_loop(int count, int threads, const std::function<void(int)>& body) {
  const auto loop = [&] { tbb::parallel_for(0, count, body); };
  if (threads > 0 && threads < tbb::info::default_concurrency()) {
    tbb::task_arena(threads).execute(loop);
    return;
  }
  // In the caller's arena, where threads are at once: in one of its own they come late for a loop of milliseconds.
  // Isolated, since a thread that waits for a loop in a body must not begin another body of the loop outside.
  tbb::this_task_arena::isolate(loop);
}
#endif

}  // namespace

void parallel_for(int count, int threads, const std::function<void(int)>& body) {
  if (threads == 1) {
    for (int i = 0; i < count; ++i) body(i);
    return;
  }
  run_loop(count, threads, body);
}

std::size_t share_count(std::size_t count) { return (count + kShare - 1) / kShare; }

void for_each_share(std::size_t count, const std::function<void(std::size_t, std::size_t, std::size_t)>& work) {
  parallel_for(static_cast<int>(share_count(count)), 0, [&](int task) {
    const auto share = static_cast<std::size_t>(task);
    work(share, share * kShare, std::min(kShare, count - share * kShare));
  });
}

}  // namespace reliefbench
