#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "tuner/search/recorded_table.h"

namespace reliefbench {

struct TunersOptions {
  int seeds = 20;                                             ///< 1, 2, ... this many
  std::vector<double> shares = {0.03, 0.05, 0.1, 0.2, 0.35};  ///< of the settings; 1: until it ends
  double part = 1;                            ///< of the settings that a seed searches, drawn anew for each; in (0, 1]
  int certificates = 20;                      ///< seeds on which `tune` runs to its certificate; 0: none
  double correlation = 0;                     ///< of a block's frames then
  int threads = 0;                            ///< 0: as many as the machine has
  std::function<void(double)> on_progress{};  ///< fraction; from any thread, one at a time
};

/// A figure over the seeds. Infinite where it is so for one of them.
struct Spread {
  double mean = 0;
  double most = 0;  ///< at least kMostSeeds of the seeds are no worse
  double worst = 0;
};
inline constexpr double kMostSeeds = 0.95;

/// A strategy when it may time so many settings (tuner/search/strategies.h, Checkpoint, says what the figures mean).
struct TunerPoint {
  double share = 0;
  Spread timed;         ///< settings
  Spread samples;       ///< frames
  Spread worst_regret;  ///< ratio - 1
  Spread mean_regret;
  Spread hypervolume;  ///< worst: least
  Spread false_front;
  int uncovered = 0;  ///< seeds that leave some budget without an answer: their regret is infinite
};

struct TunerLine {
  std::string_view strategy;
  std::string_view description;
  std::vector<TunerPoint> points;  ///< by share
};

/// What `tune` claims when it ends, against the true times.
struct CertificateCheck {
  double epsilon = 0;
  double confidence = 0;
  int seeds = 0;
  int certified = 0;            ///< seeds that ended with a certificate
  int held = 0;                 ///< of them those whose worst regret is within epsilon
  int bounded = 0;              ///< seeds in which no timed setting was taken to be slower than it is, by its lower
                                ///< bound; half of epsilon is passed over
  Spread frames_per_setting{};  ///< over the seeds; of all settings
  Spread worst_regret{};
};

struct TunerComparison {
  std::string backend;
  std::string device;
  std::string scene;
  std::string error_metric;
  std::vector<std::string> constraints;
  int settings = 0;
  int feasible = 0;
  int on_front = 0;
  int seeds = 0;
  double part = 1;               ///< of the settings, that a seed searched
  std::vector<TunerLine> lines;  ///< by strategy, in their order
  double correlation = 0;        ///< of a block's frames, see ReplaySource, while the certificate was checked
  CertificateCheck certificate{};
};

struct CertificateOptions {
  int seeds = 20;
  double part = 1;                  ///< as of TunersOptions
  int threads = 0;                  ///< likewise
  std::function<void()> on_done{};  ///< told after each seed, from any thread
};
/// Runs `tune` to its certificate on that many seeds: 1, 2, ...
/// replay: the noise of a table under a seed
[[nodiscard]] CertificateCheck check_certificate(
    const RecordedTable& table, const CertificateOptions& options,
    const std::function<std::unique_ptr<TimeSource>(const RecordedTable& table, std::uint64_t seed)>& replay);

/// Replays every strategy on a recorded sweep; all start with first_settings(). The same table and options give the
/// same figures on any machine and number of threads. throws: Error(bad_input): nothing feasible, no seed or share
[[nodiscard]] TunerComparison compare_tuners(const RecordedTable& table, const TunersOptions& options);

/// An infinite figure is null.
[[nodiscard]] nlohmann::json tuners_json(const TunerComparison& comparison);

}  // namespace reliefbench
