#include "kernels/base/parallel.h"

#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>
#if defined(__SANITIZE_THREAD__)
#include <sanitizer/tsan_interface.h>
#endif

#include <algorithm>

namespace reliefbench {
namespace {

constexpr std::size_t kShare = 1U << 16U;

#if defined(__SANITIZE_THREAD__)
// TBB is not compiled for ThreadSanitizer, so that it is told: a loop begins before all its bodies and ends after them.
class LoopOrder {
 public:
  LoopOrder() { __tsan_release(&begin_); }
  ~LoopOrder() { __tsan_acquire(&end_); }
  void enter_body() { __tsan_acquire(&begin_); }
  void leave_body() { __tsan_release(&end_); }

 private:
  char begin_ = 0;
  char end_ = 0;
};
#else
struct LoopOrder {
  void enter_body() {}
  void leave_body() {}
};
#endif

}  // namespace

void parallel_for(int count, int threads, const std::function<void(int)>& body) {
  if (threads == 1) {
    for (int i = 0; i < count; ++i) body(i);
    return;
  }
  LoopOrder order;
  const auto loop = [&] {
    tbb::parallel_for(0, count, [&](int i) {
      order.enter_body();
      body(i);
      order.leave_body();
    });
  };
  if (threads > 0 && threads < tbb::info::default_concurrency()) {
    tbb::task_arena(threads).execute(loop);
    return;
  }
  // In the caller's arena, where threads are at once: in one of its own they come late for a loop of milliseconds.
  // Isolated, since a thread that waits for a loop in a body must not begin another body of the loop outside.
  tbb::this_task_arena::isolate(loop);
}

std::size_t share_count(std::size_t count) { return (count + kShare - 1) / kShare; }

void for_each_share(std::size_t count, const std::function<void(std::size_t, std::size_t, std::size_t)>& work) {
  parallel_for(static_cast<int>(share_count(count)), 0, [&](int task) {
    const auto share = static_cast<std::size_t>(task);
    work(share, share * kShare, std::min(kShare, count - share * kShare));
  });
}

}  // namespace reliefbench
