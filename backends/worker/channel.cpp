#include "backends/worker/channel.h"

#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

struct PacketHeader {
  std::uint32_t mark = kMark;
  std::uint32_t bytes = 0;  ///< of the message
  std::uint64_t number = 0;

  static constexpr std::uint32_t kMark = 0x72626d31;
  static constexpr std::uint32_t kMostBytes = std::uint32_t{1} << 28U;
};

bool send_all(int socket, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(sent));
  }
  return true;
}

}  // namespace

bool Channel::send(std::uint64_t number, std::span<const std::byte> message) {
  if (message.size() > PacketHeader::kMostBytes)
    fail_environment("a message of {} bytes, a worker takes {}", message.size(), PacketHeader::kMostBytes);
  const PacketHeader header{.bytes = static_cast<std::uint32_t>(message.size()), .number = number};
  // In one call where the message is small: two would wake the other end twice.
  std::vector<std::byte> bytes(sizeof(header) + message.size());
  std::memcpy(bytes.data(), &header, sizeof(header));
  if (!message.empty()) std::memcpy(bytes.data() + sizeof(header), message.data(), message.size());
  return send_all(socket_.get(), bytes);
}

std::optional<Packet> Channel::next() {
  if (come_.size() < sizeof(PacketHeader)) return std::nullopt;
  PacketHeader header;
  std::memcpy(&header, come_.data(), sizeof(header));
  if (header.mark != PacketHeader::kMark || header.bytes > PacketHeader::kMostBytes)
    fail_environment("what came from a worker is no message");
  const auto end = static_cast<std::ptrdiff_t>(sizeof(PacketHeader) + header.bytes);
  if (std::ssize(come_) < end) return std::nullopt;
  Packet packet{.number = header.number, .message = {come_.begin() + sizeof(PacketHeader), come_.begin() + end}};
  come_.erase(come_.begin(), come_.begin() + end);
  return packet;
}

bool Channel::fill() {
  std::array<std::byte, 1 << 14> buffer{};
  ssize_t size = 0;
  do size = ::recv(socket_.get(), buffer.data(), buffer.size(), 0);
  while (size < 0 && errno == EINTR);
  if (size <= 0) return false;
  come_.insert(come_.end(), buffer.begin(), buffer.begin() + size);
  return true;
}

}  // namespace reliefbench
