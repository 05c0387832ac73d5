#pragma once
#include <array>
#include <chrono>
#include <string_view>

namespace reliefbench {

/// What a sweep's wall time goes to. The rest is `other`: the harness's own cost.
enum class Part {
  audit,
  bake,
  compile,
  reference,
  draw,  ///< frames that are judged, with their way back from the device
  judge,
  pictures,
  warmup,
  samples,
  cooling,  ///< pauses before a block is drawn again that the device was held back in
};
inline constexpr std::array<std::string_view, 10> kPartIds = {"audit", "bake",     "compile", "reference", "draw",
                                                              "judge", "pictures", "warmup",  "samples",   "cooling"};

/// Adds up wall time by part. Parts do not nest.
class WallSplit {
 public:
  using Clock = std::chrono::steady_clock;

  /// Runs `work` and books its wall time on `part`.
  template <typename Work>
  decltype(auto) book(Part part, Work&& work) {
    const Booking booking{*this, part, Clock::now()};
    return work();
  }
  [[nodiscard]] double seconds(Part part) const { return seconds_.at(static_cast<std::size_t>(part)); }
  [[nodiscard]] double total_seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

 private:
  struct Booking {
    WallSplit& split;
    Part part{};
    Clock::time_point from{};
    ~Booking() {
      split.seconds_.at(static_cast<std::size_t>(part)) += std::chrono::duration<double>(Clock::now() - from).count();
    }
  };

  Clock::time_point start_ = Clock::now();
  std::array<double, kPartIds.size()> seconds_{};
};

}  // namespace reliefbench
