#pragma once
#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace reliefbench {

/// Leaves elements of a trivial type that are made without a value as the memory is.
template <typename T>
struct UnfilledAllocator : std::allocator<T> {
  template <typename Other>
  struct rebind {
    using other = UnfilledAllocator<Other>;
  };
  template <typename Other, typename... Arguments>
  void construct(Other* at, Arguments&&... arguments) {
    if constexpr (sizeof...(Arguments) == 0)
      ::new (static_cast<void*>(at)) Other;
    else
      ::new (static_cast<void*>(at)) Other{std::forward<Arguments>(arguments)...};
  }
};

/// A vector for those who write every element of it, on many threads: filling it before takes as long as that.
template <typename T>
using UnfilledVector = std::vector<T, UnfilledAllocator<T>>;

}  // namespace reliefbench
