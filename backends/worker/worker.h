#pragma once
#include <sys/types.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "backends/worker/channel.h"
#include "backends/worker/shared_memory.h"
#include "kernels/base/error.h"

namespace reliefbench {

/// The process that a device was in has died, and with it whatever was made there.
class WorkerCrashed : public Error {
 public:
  explicit WorkerCrashed(const std::string& words) : Error(Exit::environment, words, Fault::device_lost) {}
};

/// A process of our own in which a driver runs. It dies with the thread that started it, if not before.
class Worker {
 public:
  /// Starts this binary, or another one of the same build, as a worker.
  /// throws: Error(environment): it cannot be started
  explicit Worker(const std::filesystem::path& binary = kThisBinary);
  /// Of one that is served elsewhere (tests): the ends of its socket and its memory.
  Worker(Descriptor socket, Descriptor memory);
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// Sends a request and waits for its reply. May be called on several threads at once. An empty reply is none: it is a
  /// sign of life, after which limit_s begins anew.
  /// what: is asked for, for messages: "the frames"
  /// throws: WorkerCrashed: it died; Error of Fault::timeout: it did not answer within limit_s of this process's
  /// running time, and was killed; of Fault::out_of_memory: the system killed it; of Fault::device_lost: it was dead
  /// before. Each with the last that it wrote to its standard output and error
  [[nodiscard]] std::vector<std::byte> call(std::span<const std::byte> request, const std::string& what,
                                            double limit_s);
  [[nodiscard]] bool is_dead() const;
  /// The last that it wrote: "; its last words: ...", or "". Not while another thread calls.
  [[nodiscard]] std::string last_words();
  [[nodiscard]] SharedMemory& memory() { return memory_; }
  [[nodiscard]] pid_t process() const { return process_; }  ///< 0: it is none of ours

  static constexpr const char* kThisBinary = "/proc/self/exe";

 private:
  using Clock = std::chrono::steady_clock;
  struct Ends {
    Descriptor ours;
    Descriptor theirs;
  };
  Worker(Ends socket, const std::filesystem::path& binary);
  [[nodiscard]] static Ends socket_ends();
  /// How a wait for a message ended.
  struct Event {
    enum Kind { reply, over, too_late, torn } kind = reply;
    Packet packet{};
  };
  /// A clock that stands still while this process does (SIGSTOP, Ctrl-Z) and should be waiting.
  [[nodiscard]] Clock::time_point run_time() const { return Clock::now() - stopped_.load(); }
  /// deadline: by run_time()
  [[nodiscard]] Event wait_until(Clock::time_point deadline);
  void take_words();
  [[noreturn]] void bury(Event::Kind how, const std::string& what, double limit_s);
  /// returns: what waitpid() says. patience_s: for its own end, then it is killed
  int end_process(double patience_s);

  SharedMemory memory_;
  Descriptor words_;  ///< its standard output and error
  Channel channel_;
  pid_t process_ = 0;
  std::atomic<Clock::duration> stopped_{};  ///< only who reads the channel adds to it
  mutable std::mutex mutex_;                ///< of all below; the channel is read by one thread at a time
  std::condition_variable changed_;
  bool is_read_ = false;
  bool is_dead_ = false;
  std::uint64_t last_number_ = 0;
  std::map<std::uint64_t, std::vector<std::byte>> replies_;
  std::string said_;  ///< the end of it
};

/// What a started worker runs, if the arguments are a worker's. returns: the process's exit status; none: they are not
[[nodiscard]] std::optional<int> run_worker(int argc, char** argv);

}  // namespace reliefbench
