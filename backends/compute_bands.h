#pragma once
#include <algorithm>
#include <chrono>
#include <string>
#include <string_view>
#include <vector>

#include "backends/backend.h"

namespace reliefbench {

/// Adds to a part's time; parts stand in the order of their first time.
inline void add_time(std::vector<ComputeTime>& times, std::string_view part, double ns) {
  const auto found = std::ranges::find(times, part, &ComputeTime::part);
  if (found == times.end()) {
    times.push_back({.part = std::string(part), .ns = ns});
  } else {
    found->ns += ns;
  }
}

/// Runs dispatch(first, count) over bands that cover [0, rows) in order, so that a watchdog of seconds never sees a
/// long one. The first is a 64th of them. After each, the rest runs at once where it will take under a second at the
/// band's speed; else bands grow fourfold while one takes under 200 ms (a small one does not fill a large device, and
/// takes no less than a larger), and halve where one takes over 800 ms. dispatch: returns when the device has done the
/// work
template <typename Dispatch>
void run_in_bands(int rows, const Dispatch& dispatch) {
  using Clock = std::chrono::steady_clock;
  using std::chrono::milliseconds;
  int band = std::max(rows / 64, 1);
  for (int first = 0; first < rows;) {
    const int count = std::min(band, rows - first);
    const Clock::time_point start = Clock::now();
    dispatch(first, count);
    const Clock::duration time = Clock::now() - start;
    first += count;
    if (time * (rows - first) < milliseconds(1000) * count) {
      band = rows;
    } else if (time < milliseconds(200)) {
      band = std::min(4 * band, rows);
    } else if (time > milliseconds(800)) {
      band = std::max(band / 2, 1);
    }
  }
}

}  // namespace reliefbench
