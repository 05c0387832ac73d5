#pragma once
#include <chrono>
#include <string>
#include <string_view>

namespace reliefbench {

/// Progress of long work on stderr: a bar with the time left on a terminal, a plain line every ten seconds elsewhere.
class Progress {
 public:
  explicit Progress(bool quiet);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// fraction: of the whole work, 0 to 1, and never less than before; label: what is being done
  void update(double fraction, std::string_view label);
  /// The work waits: shown at once, with as much done as before.
  void wait(std::string_view why);
  /// A line that stays, above the bar.
  void note(std::string_view line);
  /// What is updated afterwards is other work.
  void finish();

 private:
  using Clock = std::chrono::steady_clock;
  void show(std::string_view label);

  bool quiet_;
  bool terminal_;
  bool drawn_ = false;
  Clock::time_point start_{};  // of the first update; the time left is judged by what was done since
  double start_fraction_ = 0;
  double fraction_ = 0;
  Clock::time_point last_{};
};

}  // namespace reliefbench
