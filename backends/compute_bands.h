#pragma once
#include <algorithm>
#include <chrono>

namespace reliefbench {

/// Runs dispatch(first, count) over bands that cover [0, rows) in order. The first band is one row; they double while
/// one takes under 25 ms and halve where one takes over 100 ms, so a watchdog of seconds never sees a long one.
/// dispatch: returns when the device has done the work
template <typename Dispatch>
void run_in_bands(int rows, const Dispatch& dispatch) {
  using Clock = std::chrono::steady_clock;
  using std::chrono::milliseconds;
  int band = 1;
  for (int first = 0; first < rows;) {
    const int count = std::min(band, rows - first);
    const Clock::time_point start = Clock::now();
    dispatch(first, count);
    const Clock::duration time = Clock::now() - start;
    if (time < milliseconds(25)) band = std::min(2 * band, rows);
    if (time > milliseconds(100)) band = std::max(band / 2, 1);
    first += count;
  }
}

}  // namespace reliefbench
