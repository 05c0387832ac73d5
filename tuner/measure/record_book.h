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

  /// Makes the case that the earlier start died of a `crashed` record, if it is one of these. scenes: of all cases.
  /// Where a signal of the process's own says that it crashed, at once; what ended without a word (kill -9, power,
  /// memory) counts half.
  void enter_death(std::span<const Case> cases, std::span<const MeasuredScene> scenes, const DeviceInfo& device);
  void append(const Record& record);

  [[nodiscard]] const Record* find(std::string_view case_id) const;  ///< the latest; null: none
  /// Whether the case is not to be drawn in this start. A lost device may be no fault of the case, and a crash may have
  /// been none: such a case is drawn again; one that killed two processes only if asked.
  [[nodiscard]] bool is_finished(std::string_view case_id) const;
  /// Whether it failed in an earlier start, or that one may have died of it: it is drawn last, and by itself.
  [[nodiscard]] bool is_suspect(std::string_view case_id) const;

  static constexpr int kMostCrashes = 2;

 private:
  RunStore& store_;
  bool retry_failed_;
  std::map<std::string, Record, std::less<>> latest_;
  std::map<std::string, int, std::less<>> crashes_;
};

}  // namespace reliefbench
