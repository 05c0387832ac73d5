#pragma once
#include <cstddef>
#include <span>

#include "backends/worker/descriptor.h"

namespace reliefbench {

/// Memory that a host and its worker both see, for what is too large for messages: texels, frames, buffers. It only
/// grows. The two take turns, so that it needs no lock.
class SharedMemory {
 public:
  /// throws: Error(environment): none is to be had
  SharedMemory();
  /// Of another process, which gave this descriptor.
  explicit SharedMemory(Descriptor file) : file_(std::move(file)) {}
  ~SharedMemory();
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;

  [[nodiscard]] int descriptor() const { return file_.get(); }
  /// Forgets what is in it.
  void clear() { used_ = 0; }
  /// Copies the bytes behind those that are in it. returns: where they begin
  /// throws: Error of Fault::out_of_memory
  std::size_t append(std::span<const std::byte> bytes);
  /// Of what the other side appended. Valid until the next append() or view() of either side.
  /// throws: Error(environment): it is not that large
  [[nodiscard]] std::span<const std::byte> view(std::size_t offset, std::size_t size);

 private:
  void map(std::size_t bytes);

  Descriptor file_;
  std::byte* mapped_ = nullptr;
  std::size_t mapped_bytes_ = 0;
  std::size_t used_ = 0;
};

}  // namespace reliefbench
