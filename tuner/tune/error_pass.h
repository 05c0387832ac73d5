#pragma once
#include <functional>
#include <optional>
#include <span>
#include <string>
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

/// One score frame for each setting and scene, until should_stop() says true. Errors are exact: one frame is enough. A
/// coarse subset of about kCoarse settings spread over all comes first, so that a short limit still gets an answer.
/// judge: score of a setting in a scene, by index; its Error becomes the failure of the setting, but for a FileError
[[nodiscard]] std::vector<SettingScore> score_all(std::size_t settings, std::size_t scenes,
                                                  const std::function<FrameScore(std::size_t, std::size_t)>& judge,
                                                  const std::function<bool(std::size_t done)>& should_stop);

/// How long score_all() would take, in s, from about kProbes settings spread over all.
[[nodiscard]] double estimate_pass_s(std::size_t settings, std::size_t scenes,
                                     const std::function<FrameScore(std::size_t, std::size_t)>& judge,
                                     const std::function<bool(std::size_t done)>& should_stop);
inline constexpr std::size_t kProbes = 16;
inline constexpr std::size_t kCoarse = 64;

/// The scores for a question with fixed budgets, by bisection: error falls with the count of search steps, nearly
/// always, so that on a line of settings that differ in nothing else the first that meets the budgets is found in log n
/// frames. Lines are bisected on the first active step count of the technique's row.
[[nodiscard]] std::vector<SettingScore> score_by_bisection(
    std::span<const Settings> settings, std::size_t scenes,
    const std::function<FrameScore(std::size_t, std::size_t)>& judge,
    const std::function<bool(const FrameScore&)>& meets, const std::function<bool(std::size_t done)>& should_stop);

}  // namespace reliefbench
