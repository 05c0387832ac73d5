#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace reliefbench {

/// A setting as the search sees it: its error is known exactly, its time is not.
struct Candidate {
  std::string id;               ///< case id, unique in its space
  std::vector<int> categories;  ///< value of each categorical axis, -1 where inactive; equal tuples make one chain
  std::vector<double> steps;    ///< count of each step axis, 0 where inactive
  double error = 0;             ///< of the front's metric, >= 0
  bool is_feasible = true;      ///< meets the constraints on the other metrics
  std::vector<double> work{};   ///< what its score frame counted on each work axis, >= 0
};

/// The settings among which is searched. Chains (equal categories) hold lattices (step counts).
struct SearchSpace {
  std::vector<std::string> category_axes;
  std::vector<std::string> step_axes;
  std::vector<std::string> work_axes{};  ///< counts that are known without a timing and foretell one; may be none
  std::vector<Candidate> candidates;

  /// throws: Error(bad_input): no candidate, a duplicate id, an error or work that is NaN or negative, tuples of
  /// other lengths
  void check() const;
};

/// A sample that a search asks for.
struct FrameOf {
  std::size_t candidate = 0;
  int index = 0;  ///< counted from 0 for each candidate
};

/// Where frame times come from: a device, or a recorded table.
class TimeSource {
 public:
  TimeSource() = default;
  TimeSource(const TimeSource&) = delete;
  TimeSource& operator=(const TimeSource&) = delete;
  virtual ~TimeSource() = default;

  /// Says which samples will be asked for next, and that they are to be drawn in this order.
  virtual void will_ask(std::span<const FrameOf>) {}
  /// The index-th sample of a candidate, corrected for drift, in ns a frame.
  [[nodiscard]] virtual double frame_ns(std::size_t candidate, int index) = 0;
};

}  // namespace reliefbench
