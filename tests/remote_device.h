#pragma once
#include <sys/socket.h>

#include <array>
#include <list>
#include <map>
#include <memory>
#include <string>
#include <thread>

#include "backends/worker/remote.h"
#include "backends/worker/server.h"
#include "tests/command.h"
#include "tests/scoped_variable.h"
#include "tuner/measure/session.h"

namespace reliefbench {

/// The two ends of a worker's socket.
inline std::pair<Descriptor, Descriptor> socket_ends() {
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) std::abort();
  return {Descriptor(ends[0]), Descriptor(ends[1])};
}

/// A device that is served by a thread of this process, in the place of a worker's.
class ThreadedDevice {
 public:
  explicit ThreadedDevice(const BackendRow& row, const BackendOptions& options = {}) {
    auto [ours, theirs] = socket_ends();
    auto memory = std::make_unique<SharedMemory>();
    Descriptor same(dup(memory->descriptor()));
    server_ = std::jthread([end = std::move(theirs), memory = std::move(memory)]() mutable {
      Channel channel(std::move(end));
      serve(channel, *memory);
    });
    backend_ = open_remote(std::make_unique<Worker>(std::move(ours), std::move(same)), row, 0, options);
  }
  [[nodiscard]] Backend& operator*() { return *backend_; }

 private:
  std::jthread server_;
  std::unique_ptr<Backend> backend_;  // ends first, and with it the server
};

using Variables = std::map<std::string, std::string>;

/// Sets variables for as long as it lives, and those that a sanitizer wants in a process with preloaded libraries. What
/// crashes does so on purpose, and at once: a sanitizer takes seconds to say where.
class GivenVariables {
 public:
  explicit GivenVariables(const Variables& variables) {
    given_.emplace_back("ASAN_OPTIONS", std::string(kChildAsanOptions) + ":handle_segv=0");
    for (const auto& [name, value] : variables) given_.emplace_back(name, value);
  }

 private:
  std::list<ScopedVariable> given_;
};

/// A worker of the built binary.
inline std::unique_ptr<Worker> start_worker() { return std::make_unique<Worker>(RELIEFBENCH_BINARY); }

/// Opens each device in a worker of its own, also one that is not real.
inline std::unique_ptr<Backend> open_in_worker(const BackendRow& row, int index) {
  return open_remote(start_worker(), row, index, {});
}

}  // namespace reliefbench
