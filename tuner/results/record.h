#pragma once
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "kernels/base/error.h"
#include "kernels/base/shared_name.h"
#include "kernels/judge/score.h"
#include "tuner/plan/scene_key.h"
#include "tuner/results/statistics.h"

namespace reliefbench {

/// The layout of every file of a run; raised when one changes.
inline constexpr int kSchemaVersion = 3;

/// How a case ended.
enum class Status {
  ok,
  unsupported,    ///< the device refused something else than a shader: a format, a size, a draw
  compile_error,  ///< ... or a shader
  timeout,        ///< a frame took longer than the config allows
  device_lost,
  out_of_memory,
  invalid_timer,  ///< a time that was not finite and above zero
  throttled,      ///< the device was held back, however often it was drawn (measure/draw_block.h)
  crashed,        ///< the process that the driver was in died
};
/// Of what may be over when the case is drawn again, so that it is, once.
[[nodiscard]] bool may_pass(Status status);
[[nodiscard]] std::string_view status_id(Status status);
[[nodiscard]] Status parse_status(std::string_view id);  ///< throws: Error(bad_input)

/// Times of one case, corrected for drift by the control case.
struct FrameTime {
  Summary summary;        ///< ns a frame, drift-corrected
  double raw_median = 0;  ///< ns a frame, as measured
  std::string timer;
};

/// One line of results.jsonl. `frame_time` and `error` are there when status is ok.
struct Record {
  std::string case_id;
  std::string technique;
  std::vector<std::pair<std::string, std::string>> params;
  std::string map;
  std::string scene;     ///< its id, for people
  SceneKey scene_key{};  ///< what it is
  std::string backend;
  std::string device;
  Status status = Status::ok;
  std::string reason;
  std::optional<FrameTime> frame_time;
  std::optional<FrameScore> error;
  std::int64_t memory_bytes = 0;  ///< of the relief map
  /// From heights to texels, on the processor: of the baker as it was when the map was baked (cached maps keep that,
  /// whichever machine it was), and of encoding and packing now. 0: no map
  double bake_time_ns = 0;
  /// The same on the case's device, by its own baker (measure/device_bake.h); none where it has none, or was not asked.
  std::optional<double> device_bake_ns{};
  /// Compile with first draw of the shaded frame; none where the pipeline came from the cache.
  std::optional<double> first_draw_ns{};
  std::string timing_key;  ///< setting, scene key, SPIR-V, device, driver and stages (stages.h)
  std::string bake_key;
  std::string reference_key;
};

/// Makes the exception that is being handled a record's status and reason. otherwise: the status of an error whose
/// fault has none of its own. throws: the exception again where it is no case's own failure: a FileError, or none of
/// ours
void enter_failure(Record& record, Status otherwise);

/// What cases of several runs are matched by: the case's id with the scene's key in the place of its name. The id
/// itself where the key is unknown.
[[nodiscard]] std::string match_key(const Record& record);
[[nodiscard]] nlohmann::json summary_json(const Summary& summary);

/// One line of samples.jsonl: one batch of frames, as measured. In a run a case's id says which scene it is of.
struct Sample {
  SharedName case_id;  ///< "control@<backend>" for the control case
  int round = 0;       ///< index within the case
  int frames = 0;
  double frame_time_ns = 0;  ///< raw
  double at_ns = 0;          ///< when: ns since the run was first started, on the run's own clock (measure/run_clock.h)
  int part = 0;              ///< of a merged run: which machine's; its control samples are those of its part
};

void to_json(nlohmann::json& j, const Record& record);
void from_json(const nlohmann::json& j, Record& record);  ///< throws: Error(bad_input)

void to_json(nlohmann::json& j, const Sample& sample);
void from_json(const nlohmann::json& j, Sample& sample);

}  // namespace reliefbench
