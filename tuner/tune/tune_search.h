#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tuner/measure/progress.h"
#include "tuner/measure/sample_book.h"
#include "tuner/tune/tune.h"

namespace reliefbench {

// What tuning on a device and replay share.

/// A source of times that draws what the book does not hold yet.
class BookSource final : public TimeSource {
 public:
  /// The cases of one candidate, one a scene.
  struct Scene {
    std::vector<std::string> case_ids;  ///< one a candidate
    double weight = 1;
  };
  struct Wanted {
    std::size_t scene;
    std::size_t candidate;
  };
  using Draw = std::function<void(std::span<const Wanted>)>;
  /// draw: appends a sample of each to the book, in this order
  BookSource(const SampleBook& book, std::vector<Scene> scenes, Combine combine, Draw draw)
      : book_(book), scenes_(std::move(scenes)), combine_(combine), draw_(std::move(draw)) {}
  void will_ask(std::span<const FrameOf> round) override;
  [[nodiscard]] double frame_ns(std::size_t candidate, int index) override;

 private:
  const SampleBook& book_;
  std::vector<Scene> scenes_;
  Combine combine_;
  Draw draw_;
};

/// What the scenes so far and one more of this weight add up to: times, or the work that foretells them.
[[nodiscard]] double combined(Combine combine, double so_far, double weight, double value);

/// With fixed budgets alone every setting that meets them is as good as another. With a bound on time, too, the most
/// accurate of them is asked for.
[[nodiscard]] bool has_one_answer(const TuneQuestion& question);

/// Where there is one answer errors become 0, so that the search has one budget to answer. Where a fleet asks, the
/// error is what its other devices lose.
[[nodiscard]] SearchSpace asked_space(const SearchSpace& space, const TuneQuestion& question,
                                      const FleetLosses* fleet = nullptr);

/// Timed first: of every technique the feasible setting with the fewest features and, of these, the fewest steps.
[[nodiscard]] std::vector<std::size_t> first_settings(const SearchSpace& space);

/// Bytes of a candidate's map.
using MemoryOf = std::function<std::int64_t(std::size_t candidate)>;

/// Fills in search, pick and rungs of a result whose space and question are set.
/// fleet: null where none asks
/// budget: of the front's metric, for the pick where the question has no budgets of its own; none: the most accurate
/// max_samples: 0: no limit
void search_into(TuneResult& result, TimeSource& times, const std::function<bool()>& should_stop,
                 const std::function<void(const SearchProgress&)>& on_progress, std::optional<double> budget,
                 std::int64_t max_samples, const MemoryOf& memory_of, const FleetLosses* fleet = nullptr);

/// Of a search whose answers are all too slow, or all less accurate than the budget, the one that is nearest, and by
/// how much it misses. Both "" where there is no answer.
[[nodiscard]] std::pair<std::string, std::string> nearest_answer(const TuneResult& result,
                                                                 std::optional<double> budget);

/// How far a search is: by its gap, or by its time if that is further.
/// time: share of the time limit that is over
void show(Progress& progress, const SearchProgress& now, const TuneQuestion& question, double time);

/// The pick: the search's answer, or what choose() prefers to it among the settings that are as accurate and within the
/// bound on time, whose interval overlaps the answer's and that are certified within epsilon as well. Nothing where no
/// answer will do.
[[nodiscard]] std::optional<TunePick> pick_of(const SearchResult& search, const SearchSpace& space,
                                              const TuneQuestion& question, std::optional<double> budget,
                                              const MemoryOf& memory_of);

}  // namespace reliefbench
