#pragma once
#include <cstddef>
#include <functional>
#include <type_traits>
#include <vector>

namespace reliefbench {

/// Runs body(i) for i in [0, count) on `threads` threads (0, or more than it has: as many as the machine has), in any
/// order. An exception of a body is rethrown here.
void parallel_for(int count, int threads, const std::function<void(int)>& body);

/// The parts of [0, count) that tasks work on: one size whatever the number of threads, so that sums over them are the
/// same on every machine.
[[nodiscard]] std::size_t share_count(std::size_t count);
/// Calls work(share, first, size) for each, on all of the machine's threads, in any order.
void for_each_share(std::size_t count, const std::function<void(std::size_t, std::size_t, std::size_t)>& work);

/// The shares' sums, added in their order. of_share: (share, first, size) -> Sum, which has +=; or (first, size)
template <typename OfShare>
[[nodiscard]] auto sum_of_shares(std::size_t count, const OfShare& of_share) {
  const auto sum_of = [&](std::size_t share, std::size_t first, std::size_t size) {
    if constexpr (std::is_invocable_v<OfShare, std::size_t, std::size_t, std::size_t>)
      return of_share(share, first, size);
    else
      return of_share(first, size);
  };
  using Sum = decltype(sum_of(count, count, count));
  std::vector<Sum> sums(share_count(count));
  for_each_share(
      count, [&](std::size_t share, std::size_t first, std::size_t size) { sums[share] = sum_of(share, first, size); });
  Sum whole{};
  for (const Sum& sum : sums) whole += sum;
  return whole;
}

}  // namespace reliefbench
