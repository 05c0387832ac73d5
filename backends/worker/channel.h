#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "backends/worker/descriptor.h"

namespace reliefbench {

/// One message. Replies have the number of their request; an empty one says that work on it goes on.
struct Packet {
  std::uint64_t number = 0;
  std::vector<std::byte> message;
};

/// One end of a stream socket that carries messages.
class Channel {
 public:
  explicit Channel(Descriptor socket) : socket_(std::move(socket)) {}

  [[nodiscard]] int descriptor() const { return socket_.get(); }
  /// returns: false: the other end is gone
  [[nodiscard]] bool send(std::uint64_t number, std::span<const std::byte> message);

  /// The next message of those that have come whole; none: there is no more.
  /// throws: Error(environment): what came is no message
  [[nodiscard]] std::optional<Packet> next();
  /// Waits for more to come. returns: false: the other end is gone
  [[nodiscard]] bool fill();

 private:
  Descriptor socket_;
  std::vector<std::byte> come_;
};

}  // namespace reliefbench
