#pragma once
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "backends/backend.h"
#include "tuner/plan/scene_key.h"
#include "tuner/results/store.h"

namespace reliefbench {

/// The records of a run by case, on disk before they are used, and what they say of the cases that are still to be
/// drawn.
class RecordBook {
 public:
  /// Takes over what an earlier start left in the store.
  /// retry_failed: cases that failed count as not drawn yet
  RecordBook(RunStore& store, bool retry_failed);

  /// Makes the case in which earlier starts ended, if it is one of these, a `crashed` record: a driver may take the
  /// whole machine with it. scenes: of all cases. See CaseMark::Death::is_its_fault()
  void enter_death(std::span<const Case> cases, std::span<const MeasuredScene> scenes, const DeviceInfo& device);
  void append(const Record& record);

  [[nodiscard]] const Record* find(std::string_view case_id) const;  ///< the latest; null: none
  /// Whether its failure may_pass(), and came twice: then it is drawn again only if asked.
  [[nodiscard]] bool is_given_up(std::string_view case_id) const;
  /// Whether the case is not to be drawn in this start.
  [[nodiscard]] bool is_finished(std::string_view case_id) const;
  /// Whether it failed in an earlier start, or that one ended in it: it is drawn last, and by itself.
  [[nodiscard]] bool is_suspect(std::string_view case_id) const;

  static constexpr int kMostFailures = 2;

 private:
  RunStore& store_;
  bool retry_failed_;
  std::map<std::string, Record, std::less<>> latest_;
  std::map<std::string, int, std::less<>> failures_;
};

}  // namespace reliefbench
