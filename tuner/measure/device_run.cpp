#include "tuner/measure/device_run.h"

#include "kernels/base/clock.h"
#include "tuner/measure/run_info.h"
#include "tuner/plan/plan.h"

namespace reliefbench {

RunStart::RunStart(const Run& earlier)
    : unix_ns(earlier.info.is_object() ? earlier.info.value("started_unix_ns", reliefbench::unix_ns())
                                       : reliefbench::unix_ns()),
      clock(goes_on_at_ns(earlier, reliefbench::unix_ns() - unix_ns)) {}

void calibrate(Session& session, const Config& config, const Run& earlier, WallSplit& split) {
  std::optional<Calibration> known;
  if (earlier.info.is_object()) known = known_calibration(earlier.info, session.device());
  split.book(Part::audit, [&] {
    session.calibrate(config.measure.batch_ms, known ? &*known : nullptr);
    session.measure_fills(config.scenes);
  });
}

DeviceRun::DeviceRun(Session& session, const RunParts& parts)
    : samples(parts.store, SampleBook::Control{.id = control_case_id(session.device().backend),
                                               .reference_ns = session.calibration().reference_ns}),
      timing({.session = session,
              .book = samples,
              .measure = parts.config.measure,
              .split = parts.split,
              .mark = &parts.store.mark(),
              .slowdowns = parts.slowdowns,
              .clock = parts.start.clock,
              .cooling_pause_s = parts.cooling_pause_s,
              .progress = &parts.progress}),
      preparer({.session = session,
                .library = parts.library,
                .cache = parts.cache,
                .split = parts.split,
                .timeout_s = parts.config.measure.timeout_s,
                .flicker_frames = parts.config.measure.flicker_frames}) {}

}  // namespace reliefbench
