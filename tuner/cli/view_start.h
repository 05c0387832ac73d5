#pragma once
#include "reports/viewer/view_choice.h"
#include "tuner/cli/setting_options.h"

namespace reliefbench {

/// What `view` begins with.
struct ViewStart {
  ChosenSetting chosen;
  ViewPicks picks{};
};

/// A HEIGHTMAP that is the folder of a run or of a tune becomes `arguments.run`, whose front can be picked from; the
/// fastest of its points within the run's budgets is chosen, unless --case says another. Where nothing is said of a
/// setting, that is relaxed cone stepping's plain one, of a solid what traces it: not with is_still, since a picture is
/// of something. throws: Error(bad_input): as choose_setting(); no such scene or backend in the run;
/// Error(nothing_measured)
[[nodiscard]] ViewStart view_start(SettingArguments& arguments, bool is_still);

}  // namespace reliefbench
