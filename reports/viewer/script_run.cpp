#include "reports/viewer/script_run.h"

#include <fmt/format.h>

namespace reliefbench {

ScriptRun::Wishes ScriptRun::step(ViewChoice& choice, const ViewPicks& picks, bool is_settled) {
  if (count_) count(choice);
  while (!is_over() && !count_) {
    const ScriptLine& line = lines_[next_];
    const bool waits = line.verb == Verb::wait || line.verb == Verb::screenshot || line.verb == Verb::copy;
    if (waits && is_waiting(is_settled)) return {};
    ++next_;
    apply(line, choice, picks);
    if (line.verb == Verb::screenshot) return {.screenshot = line.words[0] + ".png"};
    if (line.verb == Verb::copy) return {.copied = line.words[0], .file = line.words[1]};
    if (line.verb == Verb::quit) return {.quit = true};
    if (line.verb != Verb::frames && line.verb != Verb::turn) continue;
    const int frames = static_cast<int>(line.numbers[0]);
    count_ = Count{
        .left = frames, .all = frames, .turns = line.verb == Verb::turn, .start = std::chrono::steady_clock::now()};
  }
  return {};
}

bool ScriptRun::is_waiting(bool is_settled) {
  settled_frames_ = is_settled ? settled_frames_ + 1 : 0;
  if (settled_frames_ <= kFramesOfLayout) return true;
  settled_frames_ = 0;
  return false;
}

void ScriptRun::count(ViewChoice& choice) {
  if (count_->left-- > 0) {
    if (count_->turns) orbit(choice.spec.scene, 1, 0);
    return;
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - count_->start;
  fmt::print("{} frames {}: {:.1f} a second\n", count_->all, count_->turns ? "while turning" : "at rest",
             count_->all / took.count());
  count_.reset();
}

}  // namespace reliefbench
