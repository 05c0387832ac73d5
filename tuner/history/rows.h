#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace reliefbench {

/// What a night was made with. Runs are compared within an environment only: a changed one opens a new epoch.
struct EnvironmentRow {
  std::int64_t id = 0;
  std::string hash;        ///< of `content`
  nlohmann::json content;  ///< what would change times by itself: CPU, memory, OS and kernel, devices, drivers, timers
};

/// The state of the sources that a run was made of.
struct BuildRow {
  std::string commit;  ///< "unknown" where nobody told
  std::string parent;  ///< "" where nobody told
  bool is_dirty = false;
};

/// "0123abcd-dirty", as `git describe --dirty` has it.
[[nodiscard]] inline std::string commit_text(const BuildRow& build) {
  return build.is_dirty ? build.commit + "-dirty" : build.commit;
}

/// What a device did in a run beside the cases: the control case, whose work never changes.
struct CalibrationRow {
  std::string device;     ///< backend and name: "vulkan llvmpipe (LLVM 15.0.6, 256 bits)"
  double control_ns = 0;  ///< raw median of a frame
  double mad = 0;         ///< of the raw times
  int n = 0;
};

/// One night: a run of one machine.
struct RunRow {  // NOLINT(bugprone-exception-escape): moving a json does not throw
  std::int64_t id = 0;
  std::string content;  ///< SHA-256 of what was imported: nothing is imported twice
  std::string kind;     ///< "reliefbench" or "google-benchmark"
  std::string machine;  ///< its name
  std::int64_t environment = 0;
  std::int64_t unix_s = 0;  ///< when it was started
  BuildRow build;
  std::string source;     ///< where it was imported from
  nlohmann::json health;  ///< {"devices": [...]}: timer and filter audit as run.json has them; {} of other kinds
  std::vector<CalibrationRow> calibrations;
};

/// What is measured every night anew. A series is of one machine.
struct SeriesRow {
  std::int64_t id = 0;
  std::string machine;
  std::string setting;    ///< case id with the scene's key in the place of its name (match_key); a benchmark's name
  std::string case_id;    ///< for people
  std::string scene;      ///< its id; "" of a benchmark
  std::string scene_key;  ///< hex; "" of a benchmark
  std::string technique;  ///< a benchmark's name up to its first '/'
  std::string map;
  std::string format;
  std::string backend;
  std::string device;  ///< as in CalibrationRow; "" of a benchmark
  std::string metric;  ///< "frame_time"; of a benchmark "real_time", "cpu_time" or a counter's name
  std::string unit;    ///< "ns", ...
  bool lower_is_better = true;
};

/// A series in one run. Only what is valid is looked at for changes.
struct RepetitionRow {
  std::int64_t run = 0;
  double median = 0;  ///< raw
  double mad = 0;     ///< of the raw samples
  int n = 0;
  /// What is compared: the median of the samples, each divided by the control samples round it in time. It has no unit.
  /// Of a benchmark, which has no control case: the median.
  double value = 0;
  double standard_error = 0;  ///< of log(value); 0 where n is 1
  bool is_valid = true;       ///< the case is ok, its timer was believed, the value is finite and positive
  std::string status;         ///< the case's; "ok" of a benchmark
  std::string code;        ///< hash of what is drawn (timing_key): shaders, device, driver, stages. "" of a benchmark
  std::int64_t score = 0;  ///< ScoreRow: all that is deterministic; 0 where there is none
  std::vector<double> samples;  ///< raw; empty unless asked for
};

/// The deterministic results of a case: error metrics, taps, memory. Equal ones are stored once.
struct ScoreRow {
  std::int64_t id = 0;
  nlohmann::json values;  ///< metric's id -> number or null
};

/// Something that a person said of a night.
struct AnnotationRow {
  std::int64_t id = 0;
  std::int64_t run = 0;    ///< 0: of an event
  std::int64_t event = 0;  ///< 0: of a run
  std::int64_t unix_s = 0;
  std::string by;
  std::string text;
};

/// What became of a change. Stored states are appended, never altered: the last one holds.
enum class EventState {
  suspect,      ///< seen, and neither re-run nor seen by enough further nights
  confirmed,    ///< by a re-run, or by more nights
  cleared,      ///< a re-run did not show it, or further nights took it back
  environment,  ///< same shaders and driver, and the control case moved along
  recovered,    ///< a later change brought the old level back
  accepted,     ///< a person took the new level for the base
};

[[nodiscard]] std::string_view event_state_id(EventState state);  ///< as they stand in the enum
[[nodiscard]] EventState parse_event_state(std::string_view id);  ///< throws: Error(bad_input)

/// A line of an event's history.
struct EventStateRow {
  std::int64_t unix_s = 0;
  EventState state = EventState::suspect;
  std::string by;  ///< "check", "confirm" or a person
  std::string text;
  bool operator==(const EventStateRow&) const = default;
};

/// What kinds of events there are.
namespace event_kind {
inline constexpr const char* slower = "slower";  ///< a step of a time, or of what else is better low
inline constexpr const char* faster = "faster";
inline constexpr const char* drift = "drift";    ///< slower little by little
inline constexpr const char* errors = "errors";  ///< a deterministic metric has another value
inline constexpr const char* lost = "lost";      ///< a case that was ok is not any more
}  // namespace event_kind

/// A change that several series may share: an alert group. Its key does not change from one night's check to the next.
struct EventRow {
  std::int64_t id = 0;
  std::string key;  ///< SHA-256 of machine, direction, series and nights as first seen; of old ones their text
  std::string machine;
  std::string kind;           ///< event_kind
  std::string what;           ///< "vulkan technique=relaxed_cone"
  std::int64_t good_run = 0;  ///< the last run that has the old level for certain
  std::int64_t bad_run = 0;   ///< the first that has the new level for certain
  double effect = 0;          ///< new / old - 1
  double low = 0;             ///< its interval
  double high = 0;
  double q = 1;       ///< false discovery rate (Benjamini-Hochberg)
  int algorithm = 0;  ///< version of the detector
  std::vector<std::int64_t> series;
  std::vector<EventStateRow> states;  ///< the oldest first; never empty
};

/// Whether its effect is a number: errors that changed and cases that are lost have none.
[[nodiscard]] inline bool has_size(const EventRow& event) {
  return event.kind != event_kind::errors && event.kind != event_kind::lost;
}

/// Everything that a check looks at, in memory.
struct HistoryView {
  bool is_whole = true;  ///< no night is left out for being too early
  std::vector<EnvironmentRow> environments;
  std::vector<RunRow> runs;  ///< by time
  std::vector<SeriesRow> series;
  std::vector<std::vector<RepetitionRow>> nights;  ///< parallel to series; by the time of their runs
  std::vector<ScoreRow> scores;                    ///< those that the nights name
  std::vector<AnnotationRow> annotations;
  std::vector<EventRow> events;
};

}  // namespace reliefbench
