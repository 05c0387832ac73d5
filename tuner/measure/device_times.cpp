#include "tuner/measure/device_times.h"

#include <vector>

namespace reliefbench {

void DeviceTimes::draw(std::span<const Wanted> round) {
  std::vector<TimedCase> cases;
  cases.reserve(round.size());
  for (const Wanted& wanted : round) cases.push_back(ready(wanted));
  time(timing_, cases);
}

const TimedCase& DeviceTimes::ready(const Wanted& wanted) {
  const std::string id = wanted.spec.id();
  if (const auto found = ready_.find(id); found != ready_.end()) return found->second->timed;
  auto fresh = std::make_unique<Ready>(Ready{.spec = wanted.spec, .prepared = {}, .timed = {}});
  {
    const auto hold = timing_.mark->hold(id);
    fresh->prepared = preparer_.prepare_to_time(fresh->spec, *wanted.scene);
  }
  if (fresh->prepared.record.status != Status::ok) throw CaseFailed(fresh->prepared.record);
  fresh->timed = warm_up(timing_, fresh->prepared.record, fresh->prepared.frame.draw);
  return ready_.emplace(id, std::move(fresh)).first->second->timed;
}

}  // namespace reliefbench
