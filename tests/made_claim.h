#pragma once
#include <string>

namespace reliefbench {

/// A claim of two rows, whose checks hold on the null backend. more_checks: after a comma each
inline std::string made_claim(const std::string& more_checks = "") {
  return R"({"source": "[X] table 1", "about": "a test",
"scene": {"heightmap": {"source": "spikes", "width": 16, "height": 16}, "views": "oblique", "frame_px": [16, 16]},
"metrics": ["e_xy.mean", "frame_time"],
"rows": [{"label": "few", "settings": "relief?linear_steps=8"},
         {"label": "cones", "settings": "cone?cone_steps=64&filter=manual"}],
"checks": [{"says": "errors", "metric": "missed_rate", "of": "cones", "at_most": 1},
           {"says": "times", "metric": "frame_time", "of": "cones", "to": "few", "quotient": 1, "tolerance": 1e9})" +
         more_checks + "]}";
}

}  // namespace reliefbench
