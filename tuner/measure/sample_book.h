#pragma once
#include <deque>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "tuner/results/store.h"

namespace reliefbench {

/// The samples of a run in the order in which they were drawn, on disk before they are used. A run that was killed
/// finds in it the very numbers that it had, so that what it decided on them it decides again.
class SampleBook {
 public:
  /// Takes over what an earlier start left in the store.
  /// control_id: name of the control case; reference_ns: its time that samples are brought to, see Calibration
  SampleBook(RunStore& store, std::string control_id, double reference_ns);

  void append(const Sample& sample);

  /// Samples of a case in ns a frame, each brought to the control case's reference time by the median of the three
  /// control samples before it; as measured where there is none.
  [[nodiscard]] const std::vector<double>& times(std::string_view case_id) const;
  [[nodiscard]] const std::vector<Sample>& samples(std::string_view case_id) const;
  [[nodiscard]] std::size_t size() const { return size_; }  ///< samples, without the control case's

 private:
  struct Page {
    std::vector<double> times;
    std::vector<Sample> samples;
  };
  void enter(const Sample& sample);
  [[nodiscard]] const Page& page(std::string_view case_id) const;

  RunStore& store_;
  std::string control_id_;
  double reference_ns_;
  std::deque<double> last_control_;
  std::map<std::string, Page, std::less<>> pages_;
  std::size_t size_ = 0;
};

}  // namespace reliefbench
