#pragma once
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tuner/results/relative_time.h"
#include "tuner/results/store.h"

namespace reliefbench {

/// The samples of a run in the order in which they were drawn, on disk before they are used. A run that was killed
/// finds in it the very numbers that it had, so that what it decided on them it decides again.
class SampleBook {
 public:
  /// The control case, and its time that samples are brought to, see Calibration.
  struct Control {
    std::string id;
    double reference_ns;
  };

  /// Of samples that nobody keeps. control: none where samples need no correction
  explicit SampleBook(std::optional<Control> control) : control_(std::move(control)) {}
  /// Takes over what an earlier start left in the store.
  SampleBook(RunStore& store, std::optional<Control> control);

  /// Its round: as many as the case has already.
  void append(Sample sample);
  /// Keeps what is told of the block of samples that ends here; where it was held back, forgets them.
  void close(const BlockState& block);

  /// Samples of a case in ns a frame, corrected as corrected_times_ns() does: as the run's tables will have them. A
  /// sample is among them once the control case was drawn after it.
  [[nodiscard]] const std::vector<double>& times(std::string_view case_id) const;
  [[nodiscard]] const std::vector<Sample>& samples(std::string_view case_id) const;
  [[nodiscard]] std::span<const Sample> control_samples() const { return control_samples_; }
  [[nodiscard]] std::size_t size() const { return size_; }  ///< samples, without the control case's

 private:
  struct Page {
    std::vector<double> times;
    std::vector<Sample> samples;
  };
  void enter(const Sample& sample);
  [[nodiscard]] const Page& page(std::string_view case_id) const;

  RunStore* store_ = nullptr;
  std::optional<Control> control_;
  std::vector<Sample> control_samples_;
  std::vector<Sample> waiting_;  // for the next control sample
  std::map<std::string, Page, std::less<>> pages_;
  std::size_t size_ = 0;
};

}  // namespace reliefbench
