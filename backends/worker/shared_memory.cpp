#include "backends/worker/shared_memory.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstring>
#include <system_error>

#include "kernels/base/error.h"
#include "kernels/base/parallel.h"

namespace reliefbench {
namespace {

constexpr std::size_t kGrain = std::size_t{1} << 20U;

std::size_t size_of(int fd) {
  struct stat status {};
  return ::fstat(fd, &status) == 0 ? static_cast<std::size_t>(status.st_size) : 0;
}

}  // namespace

SharedMemory::SharedMemory() : file_(::memfd_create("reliefbench", MFD_CLOEXEC)) {
  if (file_.get() < 0) fail_environment("no shared memory: {}", std::generic_category().message(errno));
}

SharedMemory::~SharedMemory() {
  if (mapped_ != nullptr) ::munmap(mapped_, mapped_bytes_);
}

void SharedMemory::map(std::size_t bytes) {
  void* const mapped = mapped_ == nullptr ? ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file_.get(), 0)
                                          : ::mremap(mapped_, mapped_bytes_, bytes, MREMAP_MAYMOVE);
  if (mapped == MAP_FAILED)
    fail_device(Fault::out_of_memory, "{} bytes of shared memory cannot be mapped: {}", bytes,
                std::generic_category().message(errno));
  mapped_ = static_cast<std::byte*>(mapped);
#ifdef MADV_POPULATE_WRITE  // at once, where the system can: page by page takes longer than the copy
  ::madvise(mapped_ + mapped_bytes_, bytes - mapped_bytes_, MADV_POPULATE_WRITE);
#endif
  mapped_bytes_ = bytes;
}

std::size_t SharedMemory::append(std::span<const std::byte> bytes) {
  const std::size_t offset = used_;
  const std::size_t end = offset + bytes.size();
  if (end > mapped_bytes_) {
    const std::size_t whole = (end + kGrain - 1) / kGrain * kGrain;
    // Allocated, not only made longer: else a write where memory runs out would be a signal.
    if (whole > size_of(file_.get()))
      if (const int error = ::posix_fallocate(file_.get(), 0, static_cast<off_t>(whole)); error != 0)
        fail_device(Fault::out_of_memory, "{} bytes of shared memory: {}", whole,
                    std::generic_category().message(error));
    map(whole);
  }
  for_each_share(bytes.size(), [&](std::size_t, std::size_t first, std::size_t size) {
    std::memcpy(mapped_ + offset + first, bytes.data() + first, size);
  });
  constexpr std::size_t kAlignment = 64;  // of any element that is read there
  used_ = (end + kAlignment - 1) / kAlignment * kAlignment;
  return offset;
}

std::span<const std::byte> SharedMemory::view(std::size_t offset, std::size_t size) {
  const std::size_t there = size_of(file_.get());
  if (offset > there || size > there - offset)
    fail_environment("a worker's message speaks of {} bytes at {} of {}", size, offset, there);
  if (there > mapped_bytes_) map(there);
  return {mapped_ + offset, size};
}

}  // namespace reliefbench
