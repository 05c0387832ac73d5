// Preloaded into the binary by tests (LD_PRELOAD): makes the n-th call of a kind fail, or ends the process there.
//   FAULT_CALL    write | pwrite | fsync | rename | open | mmap | pthread_create
//   FAULT_AT      which of the calls that match, from 1; 0: each
//   FAULT_ERRNO   the call fails with this number
//   FAULT_SHORT   or: of a write or pwrite, half the bytes are written
//   FAULT_SIGNAL  or: the call is done, then the process gets this signal
//   FAULT_EARLY   or before the call is done
//   FAULT_UNLINK  or: the call is done, then this file is removed
//   FAULT_FILE    only files whose path holds this text
//   FAULT_TEXT    only bytes that hold this text
//   FAULT_PROCESS only processes whose arguments hold this text
//   FAULT_MARK    a folder that is made when the fault happens
// With FAULT_SERVER, "IN OUT", the process runs no command but forks one for each request from the pipe IN: a size, 4
// bytes, and that much "NAME=VALUE\0", which are put into its environment. How it ended, as waitpid() tells it, goes to
// the pipe OUT.
#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <type_traits>

namespace {

std::string_view setting(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? std::string_view() : std::string_view(value);
}
int number(const char* name) { return std::atoi(std::string(setting(name)).c_str()); }

bool holds(std::string_view text, const char* name) { return text.find(setting(name)) != std::string_view::npos; }

std::string path_of(int fd) {
  std::array<char, 4096> target{};
  const ssize_t length = readlink(("/proc/self/fd/" + std::to_string(fd)).c_str(), target.data(), target.size());
  return length < 0 ? std::string() : std::string(target.data(), static_cast<std::size_t>(length));
}

/// The process's arguments, each behind a NUL.
std::string arguments() {
  std::string text(4096, '\0');
  const int fd = static_cast<int>(syscall(SYS_open, "/proc/self/cmdline", O_RDONLY));
  text.resize(static_cast<std::size_t>(std::max<ssize_t>(read(fd, text.data(), text.size()), 0)));
  close(fd);
  return text;
}

/// Whether it is this call's turn.
bool is_due(std::string_view call, std::string_view path, std::string_view bytes) {
  static std::atomic<int> count = 0;
  if (call != setting("FAULT_CALL") || !holds(path, "FAULT_FILE") || !holds(bytes, "FAULT_TEXT")) return false;
  if (!setting("FAULT_PROCESS").empty() && !holds(arguments(), "FAULT_PROCESS")) return false;
  const int at = number("FAULT_AT");
  return ++count == at || at == 0;
}

/// What a call returns that failed: a number, or for mmap() MAP_FAILED, which is -1 as a pointer.
template <typename Result>
Result failure(int value) {
  if constexpr (std::is_pointer_v<Result>)
    return MAP_FAILED;
  else
    return static_cast<Result>(value);
}

template <typename Real, typename Short>
auto inject(std::string_view call, std::string_view path, std::string_view bytes, const Real& real, const Short& half) {
  if (!is_due(call, path, bytes)) return real();
  if (const std::string mark(setting("FAULT_MARK")); !mark.empty()) mkdir(mark.c_str(), 0777);
  if (const int error = number("FAULT_ERRNO"); error != 0) {
    errno = error;
    return failure<decltype(real())>(call == "pthread_create" ? error : -1);
  }
  const int signal = number("FAULT_SIGNAL");
  if (signal != 0 && !setting("FAULT_EARLY").empty()) raise(signal);
  const auto result = setting("FAULT_SHORT").empty() ? real() : half();
  if (signal != 0) raise(signal);
  if (const std::string file(setting("FAULT_UNLINK")); !file.empty()) unlink(file.c_str());
  return result;
}

template <typename Real>
auto inject(std::string_view call, std::string_view path, std::string_view bytes, const Real& real) {
  return inject(call, path, bytes, real, real);
}

template <typename Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

std::string_view text(const void* bytes, std::size_t size) { return {static_cast<const char*>(bytes), size}; }

/// A call that writes; real: writes that many of the bytes.
template <typename Real>
ssize_t inject_writing(std::string_view call, int fd, std::string_view bytes, const Real& real) {
  return inject(
      call, path_of(fd), bytes, [&] { return real(bytes.size()); }, [&] { return real((bytes.size() + 1) / 2); });
}

// What has two symbols, of which SQLite uses the one that ends in 64.
static_assert(std::is_same_v<off_t, off64_t>);

ssize_t pwrite_as(const char* symbol, int fd, std::string_view bytes, off_t offset) {
  return inject_writing("pwrite", fd, bytes, [&](std::size_t count) {
    return next<decltype(pwrite)>(symbol)(fd, bytes.data(), count, offset);
  });
}

int open_as(const char* symbol, const char* path, int flags, va_list arguments) {
  const auto mode = (flags & O_CREAT) != 0 ? va_arg(arguments, mode_t) : 0;
  return inject("open", path, "", [&] { return next<int(const char*, int, ...)>(symbol)(path, flags, mode); });
}

void* mmap_as(const char* symbol, void* at, std::size_t size, int protection, int flags, int fd, off_t offset) {
  const auto real = [&] { return next<decltype(mmap)>(symbol)(at, size, protection, flags, fd, offset); };
  return fd < 0 ? real() : inject("mmap", path_of(fd), "", real);
}

using Main = int(int, char**, char**);
Main* command = nullptr;

/// In a fork: what the request says, and output files as if they were opened anew.
void take(const std::string& request) {
  for (std::size_t at = 0; at < request.size(); at = request.find('\0', at) + 1) {
    const std::string line(request.c_str() + at);
    const std::size_t equals = line.find('=');
    setenv(line.substr(0, equals).c_str(), line.substr(equals + 1).c_str(), 1);
  }
  for (const int output : {STDOUT_FILENO, STDERR_FILENO})
    if (ftruncate(output, 0) == 0) lseek(output, 0, SEEK_SET);
}

int serve(int argc, char** argv, char** /*environment*/) {
  int in = 0;
  int out = 0;
  if (std::sscanf(std::getenv("FAULT_SERVER"), "%d %d", &in, &out) != 2) return 1;
  std::uint32_t size = 0;
  while (read(in, &size, sizeof(size)) == static_cast<ssize_t>(sizeof(size))) {
    std::string request(size, '\0');
    if (size > 0 && read(in, request.data(), size) != static_cast<ssize_t>(size)) return 1;
    const pid_t child = fork();
    if (child == 0) {
      close(in);
      close(out);
      take(request);
      return command(argc, argv, environ);
    }
    int status = 0;
    waitpid(child, &status, 0);
    if (next<decltype(write)>("write")(out, &status, sizeof(status)) < 0) return 1;
  }
  return 0;
}

}  // namespace

extern "C" {

int __libc_start_main(Main* main, int argc, char** argv, void (*init)(), void (*fini)(), void (*rtld_fini)(),
                      void* stack_end) {
  command = main;
  return next<decltype(__libc_start_main)>("__libc_start_main")(std::getenv("FAULT_SERVER") == nullptr ? main : serve,
                                                                argc, argv, init, fini, rtld_fini, stack_end);
}

ssize_t write(int fd, const void* bytes, std::size_t size) {
  return inject_writing("write", fd, text(bytes, size),
                        [&](std::size_t count) { return next<decltype(write)>("write")(fd, bytes, count); });
}
ssize_t pwrite(int fd, const void* bytes, std::size_t size, off_t offset) {
  return pwrite_as("pwrite", fd, text(bytes, size), offset);
}
ssize_t pwrite64(int fd, const void* bytes, std::size_t size, off64_t offset) {
  return pwrite_as("pwrite64", fd, text(bytes, size), offset);
}
int fsync(int fd) {
  return inject("fsync", path_of(fd), "", [&] { return next<decltype(fsync)>("fsync")(fd); });
}
int fdatasync(int fd) {  // SQLite's
  return inject("fsync", path_of(fd), "", [&] { return next<decltype(fdatasync)>("fdatasync")(fd); });
}
int rename(const char* from, const char* to) noexcept {
  return inject("rename", to, "", [&] { return next<decltype(rename)>("rename")(from, to); });
}
int open(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const int fd = open_as("open", path, flags, arguments);
  va_end(arguments);
  return fd;
}
int open64(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const int fd = open_as("open64", path, flags, arguments);
  va_end(arguments);
  return fd;
}
void* mmap(void* at, std::size_t size, int protection, int flags, int fd, off_t offset) noexcept {
  return mmap_as("mmap", at, size, protection, flags, fd, offset);
}
void* mmap64(void* at, std::size_t size, int protection, int flags, int fd, off64_t offset) noexcept {
  return mmap_as("mmap64", at, size, protection, flags, fd, offset);
}
int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*start)(void*),
                   void* argument) noexcept {
  return inject("pthread_create", "", "", [&] {
    return next<int(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*)>("pthread_create")(thread, attributes,
                                                                                                   start, argument);
  });
}
}
