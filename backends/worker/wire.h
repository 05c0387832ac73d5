#pragma once
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "backends/worker/shared_memory.h"
#include "kernels/base/error.h"

namespace reliefbench {

// Values as the bytes of a message between two processes of the same binary, and back. A struct is the list of its
// members, members(x), for both ways.

template <typename T>
concept WireNumber = std::is_arithmetic_v<T> || std::is_enum_v<T>;
template <typename T>
concept WireStruct = requires(T& value) {
  members(value);
};

/// Spans of so many bytes go through shared memory.
inline constexpr std::size_t kLeastBulk = 4096;

class WireWriter {
 public:
  /// bulk: for what is large; null: there is none, all goes into the message
  explicit WireWriter(SharedMemory* bulk) : bulk_(bulk) {}

  template <typename... T>
  WireWriter& operator()(const T&... values) {
    (put(values), ...);
    return *this;
  }
  [[nodiscard]] std::span<const std::byte> message() const { return message_; }

 private:
  template <WireNumber T>
  void put(const T& value) {
    raw(std::as_bytes(std::span(&value, 1)));
  }
  void put(std::string_view text) {
    put(text.size());
    raw(std::as_bytes(std::span(text)));
  }
  template <typename T>
  void put(std::span<const T> values) {
    static_assert(std::is_trivially_copyable_v<T>);
    const std::span<const std::byte> bytes = std::as_bytes(values);
    const bool is_bulk = bulk_ != nullptr && bytes.size() >= kLeastBulk;
    put(bytes.size());
    put(is_bulk);
    if (is_bulk) return put(bulk_->append(bytes));
    message_.resize((message_.size() + alignof(T) - 1) / alignof(T) * alignof(T));
    raw(bytes);
  }
  template <typename T>
  void put(const std::vector<T>& values) {
    put(values.size());
    for (const T& value : values) put(value);
  }
  template <typename T>
  void put(const std::optional<T>& value) {
    put(value.has_value());
    if (value) put(*value);
  }
  template <typename A, typename B>
  void put(const std::pair<A, B>& pair) {
    put(pair.first);
    put(pair.second);
  }
  template <WireStruct T>
  void put(const T& value) {
    std::apply([&](const auto&... each) { (put(each), ...); }, members(value));
  }
  void raw(std::span<const std::byte> bytes) { message_.insert(message_.end(), bytes.begin(), bytes.end()); }

  SharedMemory* bulk_;
  std::vector<std::byte> message_;
};

/// Reads in the order of writing. Texts and spans that are not copied into a std::string or vector are valid as long as
/// the message and, where they are large, the shared memory are.
/// throws: Error(environment): the message is torn
class WireReader {
 public:
  WireReader(std::span<const std::byte> message, SharedMemory* bulk) : message_(message), bulk_(bulk) {}

  template <typename... T>
  WireReader& operator()(T&... values) {
    (take(values), ...);
    return *this;
  }
  template <typename T>
  [[nodiscard]] T get() {
    T value{};
    take(value);
    return value;
  }
  /// To be called after the last value.
  void end() const {
    if (at_ != message_.size()) fail_environment("a worker's message has {} bytes too many", message_.size() - at_);
  }

 private:
  std::span<const std::byte> raw(std::size_t size) {
    if (size > message_.size() - at_) fail_environment("a worker's message of {} bytes is torn", message_.size());
    at_ += size;
    return message_.subspan(at_ - size, size);
  }
  template <WireNumber T>
  void take(T& value) {
    const std::span<const std::byte> bytes = raw(sizeof(T));
    if constexpr (std::is_same_v<T, bool>)
      value = bytes.front() != std::byte{0};
    else
      std::memcpy(&value, bytes.data(), sizeof(T));
  }
  void take(std::string_view& text) {
    const std::span<const std::byte> bytes = raw(get<std::size_t>());
    text = {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }
  void take(std::string& text) { text = get<std::string_view>(); }
  template <typename T>
  void take(std::span<const T>& values) {
    const auto size = get<std::size_t>();
    if (size % sizeof(T) != 0) fail_environment("a worker's message is torn: {} bytes of {} each", size, sizeof(T));
    const std::byte* from = nullptr;
    if (get<bool>()) {
      if (bulk_ == nullptr) fail_environment("a worker's message speaks of shared memory");
      from = bulk_->view(get<std::size_t>(), size).data();
    } else {
      raw((alignof(T) - at_ % alignof(T)) % alignof(T));
      from = raw(size).data();
    }
    values = {reinterpret_cast<const T*>(from), size / sizeof(T)};
  }
  template <typename T>
  void take(std::vector<T>& values) {
    const auto count = get<std::size_t>();
    if (count > message_.size() - at_) fail_environment("a worker's message of {} bytes is torn", message_.size());
    values.clear();
    for (std::size_t i = 0; i < count; ++i) take(values.emplace_back());
  }
  template <typename T>
  void take(std::optional<T>& value) {
    value.reset();
    if (get<bool>()) take(value.emplace());
  }
  template <typename A, typename B>
  void take(std::pair<A, B>& pair) {
    take(pair.first);
    take(pair.second);
  }
  template <WireStruct T>
  void take(T& value) {
    std::apply([&](auto&... each) { (take(each), ...); }, members(value));
  }

  std::span<const std::byte> message_;
  SharedMemory* bulk_;
  std::size_t at_ = 0;
};

}  // namespace reliefbench
