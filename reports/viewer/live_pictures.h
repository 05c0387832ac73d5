#pragma once
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "backends/window/screen.h"
#include "kernels/judge/reference.h"
#include "reports/viewer/background.h"
#include "reports/viewer/pane.h"
#include "reports/viewer/view_choice.h"
#include "tuner/measure/map_library.h"
#include "tuner/measure/session.h"

namespace reliefbench {

struct LivePicturesOptions {
  const BackendRow* row = nullptr;
  int device = 0;
  bool debug = false;
  SceneSpec spec{};         ///< heightmap, wrap and frame size stay
  Heightmaps heightmaps{};  ///< what has been read already
};

/// The pictures of a choice, in a window. The device draws and shows them; maps and errors are made in the background,
/// so that update() takes no longer than a frame, a pipeline's compilation aside: that waits for one update, so that
/// the panel can say so first.
class LivePictures {
 public:
  /// throws: Error(bad_input): unreadable heightmap; Error(environment): no display, no such device
  LivePictures(const Window& window, LivePicturesOptions options);
  LivePictures(const LivePictures&) = delete;
  LivePictures& operator=(const LivePictures&) = delete;

  /// Brings the pictures nearer to the choice by what can be done at once.
  /// throws: Error(environment): the device was lost
  void update(const ViewChoice& choice);
  /// Whether everything of the choice is there, or known not to be possible.
  [[nodiscard]] bool is_settled(const ViewChoice& choice) const;
  [[nodiscard]] bool is_busy() const { return background_.is_busy() || is_compiling(); }
  /// Whether the background is at work, whose end the destructor waits for.
  [[nodiscard]] bool is_working() const { return background_.is_working(); }
  /// Whether the next update() compiles, which takes a while.
  [[nodiscard]] bool is_compiling() const { return left_.compiles_next || right_.compiles_next; }
  /// Audits the timers: seconds, in which nothing else is drawn. Until then times are the fenced wall clock's, and
  /// nothing is settled; so they stay where no timer is valid, and audit() says so. throws: Error(environment): the
  /// device was lost
  void audit_timers();
  /// By what draws the left pane, too.
  [[nodiscard]] bool is_audited() const {
    return !session_.audit().empty() && (is_compute_audited_ || !shows_compute());
  }

  [[nodiscard]] Screen& screen() { return *screen_; }
  [[nodiscard]] const Pane& left() const { return left_; }
  [[nodiscard]] const Pane& right() const { return right_; }  ///< where the choice has another setting
  [[nodiscard]] const ScreenPicture& reference() const { return *reference_; }
  /// Whether it is of the view that the left pane shows.
  [[nodiscard]] bool is_reference_current() const { return reference_key_ == left_.picture_key; }

  /// Of the left pane's frames, oldest first, ns; the last kMostTimes.
  [[nodiscard]] const std::vector<double>& times_ns() const { return times_ns_; }
  static constexpr std::size_t kMostTimes = 120;
  [[nodiscard]] Timer timer() const { return timer_; }
  [[nodiscard]] const TimerAudit& audit() const;  ///< of the timer; after audit_timers()
  [[nodiscard]] const DeviceInfo& device() const { return session_.device(); }
  [[nodiscard]] const LoadedHeights& heights() const { return heights_; }
  /// What the API's debug output said so far.
  [[nodiscard]] std::vector<std::string> complaints() { return session_.backend().debug_messages(); }
  /// Draws the left pane's frame so often, and says how long each took, ns; none: there is nothing to draw yet.
  [[nodiscard]] std::vector<double> time_again(int frames);

 private:
  using Clock = std::chrono::steady_clock;

  [[nodiscard]] bool shows_compute() const { return left_.settings && is_by_compute(*left_.settings); }
  void judge_next(const ViewChoice& choice);
  void bring(Pane& pane, const Settings& settings, const SceneSpec& spec);
  void draw(Pane& pane, const Settings& settings, const SceneSpec& spec);
  void fetch_map(Pane& pane, const Settings& settings, const SceneSpec& spec, std::string key);
  void judge_in_background(Pane& pane, const SceneSpec& spec);
  void draw_reference(const std::vector<ReferenceHit>& hits, const std::vector<PixelFeature>& features,
                      const FeatureValues& values, const FrameUniforms& frame);
  void lay_over(Pane& pane, Overlay overlay);
  void keep_time(double ns);

  WallSplit split_;
  Session session_;
  std::unique_ptr<Screen> screen_;
  Cache cache_ = Cache::open();
  WallSplit background_split_;
  MapLibrary library_;  // the background's alone, from the constructor on
  const LoadedHeights& heights_;
  ReferenceTracer tracer_;
  std::unique_ptr<const Mesh> mesh_;  ///< null: the relief lies on none
  Timer timer_ = Timer::fenced_wall;
  bool is_compute_audited_ = false;
  Pane left_;
  Pane right_;
  std::unique_ptr<ScreenPicture> reference_;
  std::string reference_key_{};
  std::vector<double> times_ns_{};
  std::string last_key_{};           ///< of the left picture, an update ago
  Clock::time_point judge_after_{};  ///< not before then while the camera moves
  Background background_;            // last: it ends before what it works on
};

}  // namespace reliefbench
