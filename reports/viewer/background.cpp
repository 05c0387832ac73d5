#include "reports/viewer/background.h"

#include <cassert>
#include <exception>
#include <utility>

namespace reliefbench {

Background::Background() : thread_([this](const std::stop_token& stop) { run(stop); }) {}

Background::~Background() = default;

bool Background::is_busy() const {
  const std::lock_guard lock(mutex_);
  return is_working_ || done_;
}

bool Background::is_working() const {
  const std::lock_guard lock(mutex_);
  return is_working_;
}

void Background::start(Work work) {
  const std::lock_guard lock(mutex_);
  assert(!is_working_ && !done_);
  work_ = std::move(work);
  is_working_ = true;
  changed_.notify_one();
}

void Background::finish() {
  std::optional<Finish> done;
  {
    const std::lock_guard lock(mutex_);
    std::swap(done, done_);
  }
  if (done) (*done)();
}

void Background::run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [this] { return work_.has_value(); })) {
    const Work work = std::move(*work_);
    work_.reset();
    lock.unlock();
    Finish done;
    try {
      done = work();
    } catch (...) {
      done = [failure = std::current_exception()] { std::rethrow_exception(failure); };
    }
    lock.lock();
    done_ = std::move(done);
    is_working_ = false;
  }
}

}  // namespace reliefbench
