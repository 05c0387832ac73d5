#pragma once
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tuner/measure/progress.h"
#include "tuner/measure/timing.h"
#include "tuner/search/observations.h"
#include "tuner/tune/tune.h"

namespace reliefbench {

/// How long a tuner may go on. It starts with the object.
class TuneClock {
 public:
  explicit TuneClock(const TuneOptions& options) : options_(options) {}

  [[nodiscard]] double elapsed_s() const;
  [[nodiscard]] double limit_s() const;  ///< infinite where there is none
  /// Whether it has had that long, or the user wants no more.
  [[nodiscard]] bool is_over(double until_s);
  [[nodiscard]] bool is_stopped() const { return is_stopped_; }  ///< is_over() said so once

 private:
  using Clock = std::chrono::steady_clock;
  const TuneOptions& options_;
  Clock::time_point start_ = Clock::now();
  bool is_stopped_ = false;
};

/// Where a tuner has its settings, their errors and their times from: a device, or a recorded run. Scenes and
/// candidates go by index; candidates are those of the last space().
class TuneSource {
 public:
  virtual ~TuneSource() = default;
  TuneSource() = default;
  TuneSource(const TuneSource&) = delete;
  TuneSource& operator=(const TuneSource&) = delete;

  /// What is known before the search: subject, metric, constraints, counts.
  [[nodiscard]] virtual TuneResult blank() const = 0;
  /// Error of the front's metric for the pick, where the question has no bounds of its own; none: the most accurate.
  [[nodiscard]] virtual std::optional<double> asked_error() const = 0;
  /// Samples after which the search gives a certificate up; 0: it goes on until it has one.
  [[nodiscard]] virtual std::int64_t patience() const { return 0; }
  /// The scored settings; error and work: over these scenes.
  [[nodiscard]] virtual SearchSpace space(std::span<const std::size_t> scenes) = 0;
  /// Their times, those of these scenes combined. They may throw CaseFailed.
  [[nodiscard]] virtual std::unique_ptr<TimeSource> times(std::span<const std::size_t> scenes) = 0;
  [[nodiscard]] virtual std::int64_t memory_bytes(std::size_t scene, std::size_t candidate) = 0;  ///< of its map
  /// All times of a setting in a scene so far, ns a frame.
  [[nodiscard]] virtual std::vector<double> times_ns(std::size_t scene, const std::string& setting) const = 0;
  /// Of settings that all miss what is asked, the one that does so least, and by how much.
  [[nodiscard]] virtual std::pair<std::string, std::string> nearest() const = 0;
  /// The device with the first scene, and what was timed there so far, as a run that a fleet takes.
  [[nodiscard]] virtual TunePlace place() const = 0;
  [[nodiscard]] virtual FleetRun timed_run() = 0;
  /// Where what is done is shown, and that a device cools.
  [[nodiscard]] virtual Progress& progress() = 0;
  /// Enters a failure. is_left_out: from here on its setting is no candidate
  virtual void take_failure(const CaseFailed& failed, bool is_left_out) = 0;
};

/// Samples of a setting from which a fleet's choice takes it: a block of the search.
inline constexpr std::size_t kLeastTold = kBlock;

/// A fleet that is matched with the place that is tuned on.
struct MatchedFleet {
  std::vector<FleetRun> runs;
  FleetOptions options;
  FleetLosses losses;
};
/// None where the options have none. throws: Error(bad_input): a run of another scene; as choose_for_fleet()
[[nodiscard]] std::optional<MatchedFleet> match_fleet(const TuneSource& source, const TuneOptions& options);

/// The tuner's engine: races for what the question asks in all scenes, then in each by itself.
/// fleet: of match_fleet(); taken over by the result
[[nodiscard]] TuneResult tune(TuneSource& source, const TuneOptions& options, TuneClock& clock,
                              std::optional<MatchedFleet> fleet = std::nullopt);

}  // namespace reliefbench
