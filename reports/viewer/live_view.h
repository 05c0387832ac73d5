#pragma once
#include <vector>

#include "kernels/image/heightmaps.h"
#include "reports/viewer/view_choice.h"
#include "reports/viewer/view_script.h"

namespace reliefbench {

struct BackendRow;

/// What `view` is to show in a window.
struct LiveViewOptions {
  const BackendRow* row = nullptr;
  int device = 0;
  bool debug = false;  ///< what the API's debug output says ends the session as an error
  ViewChoice choice;
  ViewPicks picks{};
  Heightmaps heightmaps{};  ///< what has been read already
  bool has_script = false;
  std::vector<ScriptLine> script{};  ///< at its end the window closes
};

/// Shows it until the window is closed.
/// throws: Error(bad_input): unreadable heightmap, a line of the script; Error(environment): no display, no such
/// device, a device that was lost
void show_live(LiveViewOptions options);

}  // namespace reliefbench
