#pragma once
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

namespace reliefbench {

/// One thread beside the window's, for what takes longer than a frame may: bakes, exact hits.
class Background {
 public:
  /// What is to be done of a result in the window's thread.
  using Finish = std::function<void()>;
  /// Runs in the background. What it throws, finish() throws.
  using Work = std::function<Finish()>;

  Background();
  ~Background();  ///< waits for the end of what is being done
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;

  /// Whether there is something to be done or to be finished. One work at a time.
  [[nodiscard]] bool is_busy() const;
  /// Whether something is being done.
  [[nodiscard]] bool is_working() const;
  /// Not while it is busy.
  void start(Work work);
  /// Calls a work's Finish, if there is one by now.
  void finish();

 private:
  void run(const std::stop_token& stop);

  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::optional<Work> work_;
  std::optional<Finish> done_;
  bool is_working_ = false;
  std::jthread thread_;  // last: it uses the others
};

}  // namespace reliefbench
