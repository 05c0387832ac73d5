#pragma once
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "kernels/judge/metric.h"
#include "tuner/plan/config.h"

namespace reliefbench {

/// What a setting's score frames said.
enum class Scored {
  no,       ///< not drawn
  yes,      ///< scores are there, one a scene
  failed,   ///< drawing failed
  assumed,  ///< not drawn: fewer steps already meet the budgets, and more of them are taken to be no faster
  hopeless  ///< not drawn: more steps still miss the budgets
};
struct SettingScore {
  Scored scored = Scored::no;
  std::string failure{};             ///< where it failed
  std::vector<FrameScore> scores{};  ///< one a scene
};

/// The errors of settings, one score frame for each setting and scene. Errors are exact: one frame is enough. Of what
/// is drawn, each technique has its turn, so that a pass that is cut short still knows something of every one.
class ErrorPass {
 public:
  struct Frames {
    /// Score of a setting in a scene, by index; its Error becomes the failure of the setting, but for a FileError.
    std::function<FrameScore(std::size_t setting, std::size_t scene)> judge;
    std::function<bool(std::size_t done)> should_stop;  ///< done: settings of which enough is known
  };
  static constexpr std::size_t kCoarse = 32;

  /// settings must outlive the pass
  ErrorPass(std::span<const Settings> settings, std::size_t scenes, Frames frames);

  /// Scores kCoarse settings, but no more than a quarter. Returns how long all of them would take, in s.
  double score_coarse();
  /// Scores what is not scored yet.
  void score_rest();
  /// Scores what a question with fixed budgets needs: error falls with the count of search steps, nearly always, so
  /// that on a line of settings that differ in nothing else the first that meets the budgets is found in log n frames.
  /// Lines run along the first active step count of the technique's row.
  void bisect(const std::function<bool(const FrameScore&)>& meets);

  [[nodiscard]] std::vector<SettingScore> take() { return std::move(scores_); }  ///< one a setting

 private:
  bool score(std::size_t setting);  ///< false: it is time to stop
  bool bisect_line(std::span<const std::size_t> line, const std::function<bool(const FrameScore&)>& meets);

  std::span<const Settings> settings_;
  std::size_t scenes_;
  Frames frames_;
  std::vector<SettingScore> scores_;
  std::vector<std::size_t> order_;
  std::size_t done_ = 0;
};

}  // namespace reliefbench
