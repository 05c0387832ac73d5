#pragma once
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tuner/measure/device_run.h"
#include "tuner/measure/record_book.h"
#include "tuner/plan/plan.h"
#include "tuner/results/coarse_filter.h"
#include "tuner/tune/tune.h"

namespace reliefbench {

/// A device and the run that a search leaves of it: what was scored, timed and entered, case by case. Goes on where an
/// earlier start of the same question was killed.
class TuneRun {
 public:
  /// throws: as run_tune()
  TuneRun(Config config, const TuneOptions& options);

  [[nodiscard]] const Config& config() const { return config_; }  ///< every scene with its frame's size
  [[nodiscard]] const std::string& frame_choice() const { return frame_choice_; }  ///< DefaultFrame::why; "": not asked
  [[nodiscard]] const std::vector<Settings>& settings() const { return settings_; }  ///< of the space
  [[nodiscard]] std::size_t conflicts() const { return plan_.conflicts.size(); }
  [[nodiscard]] const std::vector<MeasuredScene>& tuned() const { return tuned_; }  ///< one a scene of the config
  [[nodiscard]] const std::vector<MeasuredScene>& holdout() const { return holdout_; }
  [[nodiscard]] const DeviceInfo& device() const { return session_->device(); }
  [[nodiscard]] CoarseFilter filter() const;
  [[nodiscard]] std::vector<std::string> frame_notes() const;
  [[nodiscard]] MapLibrary& library() { return library_; }
  [[nodiscard]] const SampleBook& book() const { return run_->samples; }
  [[nodiscard]] Progress& progress() { return progress_; }

  /// Of a case's score frame; with_pictures: of all its frames. throws: Error: it cannot be drawn
  [[nodiscard]] FrameScore score(const Case& c, const SceneSpec& scene, bool with_pictures);

  struct Wanted {
    Case spec;
    const SceneSpec* scene = nullptr;
  };
  /// time() of these cases, each prepared and warmed up when it is first asked for. Where the device is lost over the
  /// control case, it is opened again, and the round is drawn from its start. throws: CaseFailed
  void draw(std::span<const Wanted> round);
  /// The record of a case that was timed, with its error: as an earlier start left it if nothing was drawn
  /// since, or a search that is asked for again would enter it again.
  const Record& whole_record(const Case& c, const SceneSpec& scene);
  /// Enters the record of a case that failed; opens the device again where that was lost.
  void take_failure(const CaseFailed& failed);
  /// The record of a case that is not to be drawn again (RecordBook::is_given_up); null for any other.
  [[nodiscard]] const Record* given_up(const std::string& case_id) const;
  /// Whether the device is to be opened again.
  [[nodiscard]] bool is_lost(Fault fault) const { return session_->is_lost(fault); }
  /// Opens the device again after it was lost.
  void reopen();

  /// Whether the error pass bisects, once it is decided, by this start or an earlier one.
  [[nodiscard]] const std::optional<bool>& is_bisected() const { return is_bisected_; }
  void set_bisected(bool is_bisected) { is_bisected_ = is_bisected; }
  void write_info(bool finished);
  /// Those that a report shows, and no other. run: what is in the folder
  void write_pictures(const Run& run);

 private:
  struct Ready {
    Case spec;
    PreparedCase prepared;
    TimedCase timed;
  };
  /// Settles how large frames are whose scene does not say it.
  void set_frames();
  /// As run.json has it, of the device alone.
  [[nodiscard]] nlohmann::json device_info() const;
  [[nodiscard]] std::vector<Case> all_cases() const;
  void draw_once(std::span<const Wanted> round);
  [[nodiscard]] const TimedCase& ready(const Wanted& wanted);
  const Record& keep(const Record& record);
  /// Enters the exception that is being handled where it may pass, for the next start to count.
  void keep_failure(const Case& c, const SceneSpec& scene);

  Config config_;
  const TuneOptions& options_;
  std::string frame_choice_;
  Progress progress_;
  WallSplit split_;
  Plan plan_;
  Cache cache_;
  MapLibrary library_;
  std::vector<MeasuredScene> tuned_;
  std::vector<MeasuredScene> holdout_;
  std::vector<MeasuredScene> scenes_;  // of this start and earlier ones
  std::vector<Settings> settings_;
  std::unique_ptr<Session> session_;
  std::unique_ptr<RunStore> store_;
  std::unique_ptr<RecordBook> records_;
  std::optional<RunStart> start_;
  std::unique_ptr<DeviceRun> run_;
  std::map<std::string, std::unique_ptr<Ready>> ready_;  // by case id
  std::optional<bool> is_bisected_;
};

}  // namespace reliefbench
