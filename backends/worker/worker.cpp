#include "backends/worker/worker.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <poll.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <system_error>
#include <thread>
#include <utility>

#include "backends/worker/remote.h"
#include "backends/worker/server.h"
#include "kernels/base/console.h"
#include "kernels/base/stop_signals.h"

namespace reliefbench {
namespace {

constexpr const char* kWorkerCommand = "worker";
constexpr time_t kSendLimit_s = 60;    // a worker takes requests at once
constexpr double kEndPatience_s = 2;   // for an orderly end: drivers write their caches
constexpr double kKillPatience_s = 2;  // a process that its driver's kernel part holds is not waited for
constexpr std::chrono::milliseconds kMostOfAWait(200);
constexpr std::size_t kMostSaid = 4096;  // bytes of last words
constexpr std::size_t kSaidLines = 3;

[[noreturn]] void fail_start(const char* what) {
  fail_environment("no worker process: {}: {}", what, std::generic_category().message(errno));
}

int number_of(std::string_view text) {
  int number = -1;
  std::from_chars(text.data(), text.data() + text.size(), number);
  return number;
}

/// Whatever else the host had open.
void close_all_but(int a, int b) {
  const auto close_from = [](int first, int last) {
    if (first <= last) static_cast<void>(::close_range(static_cast<unsigned>(first), static_cast<unsigned>(last), 0));
  };
  const auto [low, high] = std::minmax(a, b);
  close_from(STDERR_FILENO + 1, low - 1);
  close_from(low + 1, high - 1);
  close_from(high + 1, std::numeric_limits<int>::max());
}

/// What a terminal or a batch system sends to the whole group: a worker is started with it blocked, and ignores it.
sigset_t ends_of_group() {
  sigset_t ends;
  ::sigemptyset(&ends);
  for (const int signal : kStopSignals) ::sigaddset(&ends, signal);
  return ends;
}

void limit_memory() {
  // Where the system's memory runs out, the worker is to go and not its host.
  std::ofstream("/proc/self/oom_score_adj") << 500;
  const char* const given = std::getenv(kWorkerMemory);
  const long mebibytes = given == nullptr ? 0 : std::strtol(given, nullptr, 10);
  if (mebibytes <= 0) return;
  const rlim_t bytes = static_cast<rlim_t>(mebibytes) << 20U;
  const rlimit limit{.rlim_cur = bytes, .rlim_max = bytes};
  ::setrlimit(RLIMIT_DATA, &limit);
}

}  // namespace

Worker::Ends Worker::socket_ends() {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) fail_start("socketpair");
  const timeval limit{.tv_sec = kSendLimit_s, .tv_usec = 0};
  ::setsockopt(ends[0], SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof(limit));
  return {.ours = Descriptor(ends[0]), .theirs = Descriptor(ends[1])};
}

Worker::Worker(const std::filesystem::path& binary) : Worker(socket_ends(), binary) {}

Worker::Worker(Descriptor socket, Descriptor memory) : memory_(std::move(memory)), channel_(std::move(socket)) {}

Worker::Worker(Ends socket, const std::filesystem::path& binary) : channel_(std::move(socket.ours)) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC | O_NONBLOCK) != 0) fail_start("pipe");
  words_ = Descriptor(ends[0]);
  const Descriptor written(ends[1]);
  ::fcntl(written.get(), F_SETFL, 0);

  std::vector<std::string> words = {"reliefbench", kWorkerCommand, std::to_string(socket.theirs.get()),
                                    std::to_string(memory_.descriptor()), std::to_string(::getpid())};
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);

  posix_spawn_file_actions_t files;
  ::posix_spawn_file_actions_init(&files);
  // Nothing to read: the end of the pipe that is written to. A bare root may have no /dev/null.
  ::posix_spawn_file_actions_adddup2(&files, written.get(), STDIN_FILENO);
  for (const int output : {STDOUT_FILENO, STDERR_FILENO})
    ::posix_spawn_file_actions_adddup2(&files, written.get(), output);
  // Onto itself: then it is not closed in the new process.
  for (const int kept : {socket.theirs.get(), memory_.descriptor()})
    ::posix_spawn_file_actions_adddup2(&files, kept, kept);
  posix_spawnattr_t how;
  ::posix_spawnattr_init(&how);
  const sigset_t blocked = ends_of_group();
  ::posix_spawnattr_setsigmask(&how, &blocked);
  ::posix_spawnattr_setflags(&how, POSIX_SPAWN_SETSIGMASK);
  errno = ::posix_spawn(&process_, binary.c_str(), &files, &how, arguments.data(), environ);
  ::posix_spawnattr_destroy(&how);
  ::posix_spawn_file_actions_destroy(&files);
  if (errno != 0) {
    process_ = 0;
    fail_start(binary.c_str());
  }
}

Worker::~Worker() {
  if (is_dead_) return;
  ::shutdown(channel_.descriptor(), SHUT_RDWR);
  static_cast<void>(end_process(kEndPatience_s));
}

bool Worker::is_dead() const {
  const std::lock_guard lock(mutex_);
  return is_dead_;
}

std::vector<std::byte> Worker::call(std::span<const std::byte> request, const std::string& what, double limit_s) {
  constexpr double kLongest_s = 1e8;  // a clock's range
  const auto limit = [&] {
    return limit_s < kLongest_s
               ? run_time() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(limit_s))
               : Clock::time_point::max();
  };
  Clock::time_point deadline = limit();
  std::unique_lock lock(mutex_);
  const auto check_alive = [&] {
    if (is_dead_) fail_device(Fault::device_lost, "{}: the driver's process has ended before", what);
  };
  check_alive();
  const std::uint64_t number = ++last_number_;
  if (!channel_.send(number, request)) {
    // Another thread may be reading what the worker says: it is to meet the end, too, and buries the worker.
    ::shutdown(channel_.descriptor(), SHUT_RDWR);
    changed_.wait(lock, [&] { return !is_read_; });
    check_alive();
    bury(Event::over, what, limit_s);
  }
  for (;;) {
    if (auto found = replies_.extract(number); !found.empty()) return std::move(found.mapped());
    check_alive();
    if (is_read_) {
      changed_.wait(lock);
      continue;
    }
    is_read_ = true;
    lock.unlock();
    Event event = wait_until(deadline);
    lock.lock();
    is_read_ = false;
    if (event.kind != Event::reply) bury(event.kind, what, limit_s);
    if (!event.packet.message.empty())
      replies_.emplace(event.packet.number, std::move(event.packet.message));
    else if (event.packet.number == number)
      deadline = limit();
    changed_.notify_all();
  }
}

Worker::Event Worker::wait_until(Clock::time_point deadline) {
  using std::chrono::milliseconds;
  try {
    for (;;) {
      if (auto packet = channel_.next()) return {.kind = Event::reply, .packet = std::move(*packet)};
      const auto left = std::chrono::ceil<milliseconds>(deadline - run_time());
      const bool is_last = left <= milliseconds::zero();  // a look at what has come meanwhile
      const milliseconds wait = std::clamp(left, milliseconds::zero(), kMostOfAWait);
      std::array<pollfd, 2> ends{pollfd{.fd = channel_.descriptor(), .events = POLLIN, .revents = 0},
                                 pollfd{.fd = words_.get(), .events = POLLIN, .revents = 0}};
      const Clock::time_point start = Clock::now();
      const int ready = ::poll(ends.data(), ends.size(), static_cast<int>(wait.count()));
      const Clock::duration beyond = Clock::now() - start - wait;
      if (beyond > Clock::duration::zero()) stopped_ = stopped_.load() + beyond;
      if (ready < 0) continue;  // a signal
      if (ends[1].revents != 0) take_words();
      if (ends[0].revents != 0 && !channel_.fill()) return {.kind = Event::over};
      if (is_last && ends[0].revents == 0) return {.kind = Event::too_late};
    }
  } catch (const Error&) {
    return {.kind = Event::torn};
  }
}

/// What a driver says is passed on, and its end kept.
void Worker::take_words() {
  std::array<char, kMostSaid> buffer{};
  for (;;) {
    const ssize_t size = ::read(words_.get(), buffer.data(), buffer.size());
    if (size == 0) words_ = {};
    if (size <= 0) return;
    const std::string_view words(buffer.data(), static_cast<std::size_t>(size));
    write_stderr(words);
    said_ += words;
    if (said_.size() > kMostSaid) said_.erase(0, said_.size() - kMostSaid);
  }
}

std::string Worker::last_words() {
  if (words_.get() >= 0) take_words();
  std::vector<std::string> lines;
  std::string_view left = said_;
  while (!left.empty() && lines.size() < kSaidLines) {
    const std::size_t before = left.find_last_of('\n');
    const std::string_view line = before == std::string_view::npos ? left : left.substr(before + 1);
    if (!line.empty()) lines.insert(lines.begin(), one_line(line));
    left = before == std::string_view::npos ? "" : left.substr(0, before);
  }
  return lines.empty() ? "" : fmt::format("; its last words: {}", fmt::join(lines, " / "));
}

int Worker::end_process(double patience_s) {
  if (process_ == 0) return 0;
  int status = 0;
  const auto has_ended = [&](double seconds) {
    const auto until = Clock::now() + std::chrono::duration<double>(seconds);
    do {
      const pid_t ended = ::waitpid(process_, &status, WNOHANG);
      if (ended == process_ || (ended < 0 && errno == ECHILD)) return true;
      std::this_thread::sleep_for(std::chrono::microseconds(300));
    } while (Clock::now() < until);
    return false;
  };
  if (!has_ended(patience_s)) {
    ::kill(process_, SIGKILL);
    static_cast<void>(has_ended(kKillPatience_s));
  }
  process_ = 0;
  return status;
}

void Worker::bury(Event::Kind how, const std::string& what, double limit_s) {
  is_dead_ = true;
  changed_.notify_all();
  const int status = end_process(how == Event::over ? kEndPatience_s : 0);
  const std::string words = last_words();
  if (how == Event::too_late)
    fail_device(Fault::timeout, "{} did not end within {:.3g} s, and the driver's process was killed{}", what, limit_s,
                words);
  if (how == Event::torn)
    throw WorkerCrashed(fmt::format("{}: the driver's process wrote what is no reply{}", what, words));
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL)
    fail_device(Fault::out_of_memory, "{}: the driver's process was killed, as the system does where memory runs out{}",
                what, words);
  if (WIFSIGNALED(status))
    throw WorkerCrashed(fmt::format("{}: the driver crashed: {}{}", what, ::strsignal(WTERMSIG(status)), words));
  throw WorkerCrashed(fmt::format("{}: the driver ended its process with status {}{}", what,
                                  WIFEXITED(status) ? WEXITSTATUS(status) : status, words));
}

std::optional<int> run_worker(int argc, char** argv) {
  constexpr int kArguments = 5;  // as the host starts it
  if (argc != kArguments || std::string_view(argv[1]) != kWorkerCommand) return std::nullopt;
  const int socket = number_of(argv[2]);
  const int memory = number_of(argv[3]);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (socket < 0 || memory < 0 || ::getppid() != number_of(argv[4])) return EXIT_FAILURE;
  // The host may still need its device; when it ends, so do we.
  for (const int signal : kStopSignals) std::signal(signal, SIG_IGN);
  const sigset_t blocked = ends_of_group();
  ::sigprocmask(SIG_UNBLOCK, &blocked, nullptr);
  close_all_but(socket, memory);
  limit_memory();
  try {
    Channel channel{Descriptor(socket)};
    SharedMemory shared{Descriptor(memory)};
    serve(channel, shared);
  } catch (const std::exception& error) {
    print_error(error.what());
    std::_Exit(EXIT_FAILURE);
  }
  std::_Exit(EXIT_SUCCESS);  // without what drivers do at the end of a process
}

}  // namespace reliefbench
