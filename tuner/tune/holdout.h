#pragma once
#include <span>
#include <vector>

#include "tuner/plan/scene_key.h"

namespace reliefbench {

/// Hold-outs under names that nothing else has in the run: where one is called as a scene that is tuned on, as another
/// hold-out, or as an earlier start's from another file, it goes by its heights' hash, too: "rocks.4cc2dca1/grazing".
/// One that was held out by an earlier start keeps its name. The same scene twice is one. throws: Error(bad_input): a
/// hold-out that is tuned on
[[nodiscard]] std::vector<MeasuredScene> named_holdout(std::span<const MeasuredScene> asked,
                                                       std::span<const MeasuredScene> tuned,
                                                       std::span<const MeasuredScene> earlier);

}  // namespace reliefbench
