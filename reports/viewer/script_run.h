#pragma once
#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "reports/viewer/view_script.h"

namespace reliefbench {

/// A script at work: what it wants of the frame that is drawn next.
class ScriptRun {
 public:
  explicit ScriptRun(std::vector<ScriptLine> lines) : lines_(std::move(lines)) {}

  struct Wishes {
    std::string screenshot{};  ///< file to write this frame's window to; "": none
    std::string copied{};      ///< one of copied_kinds() to write; "": none
    std::string file{};        ///< ... to
    bool quit = false;
  };
  /// Called before each frame. is_settled: everything of the choice is there
  /// throws: Error(bad_input) with the line's place
  [[nodiscard]] Wishes step(ViewChoice& choice, const ViewPicks& picks, bool is_settled);
  [[nodiscard]] bool is_over() const { return next_ >= lines_.size() && !count_; }

 private:
  /// Frames that are counted.
  struct Count {
    int left;
    int all;
    bool turns;
    std::chrono::steady_clock::time_point start;
  };
  /// Dear ImGui lays out by what it saw in the frames before.
  static constexpr int kFramesOfLayout = 3;

  [[nodiscard]] bool is_waiting(bool is_settled);
  void count(ViewChoice& choice);

  std::vector<ScriptLine> lines_;
  std::size_t next_ = 0;
  int settled_frames_ = 0;
  std::optional<Count> count_{};
};

}  // namespace reliefbench
