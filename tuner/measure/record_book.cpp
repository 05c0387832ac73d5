#include "tuner/measure/record_book.h"

#include <fmt/format.h>

#include <algorithm>

#include "tuner/measure/prepare.h"

namespace reliefbench {

RecordBook::RecordBook(RunStore& store, bool retry_failed)
    : store_(store),
      retry_failed_(retry_failed),
      failures_(store.earlier().failures.begin(), store.earlier().failures.end()) {
  for (const Record& record : store.earlier().records) latest_.insert_or_assign(record.case_id, record);
}

void RecordBook::enter_death(std::span<const Case> cases, std::span<const MeasuredScene> scenes,
                             const DeviceInfo& device) {
  const std::optional<CaseMark::Death>& death = store_.mark().death();
  if (!death || !death->is_its_fault()) return;
  const auto found = std::ranges::find(cases, death->case_id, &Case::id);
  if (found == cases.end() || found->backend != device.backend) return;
  const auto scene = std::ranges::find(scenes, found->scene_id, [](const MeasuredScene& one) { return one.spec.id; });
  if (scene == scenes.end()) return;
  Record record = blank_record(*found, scene->key, device);
  record.status = Status::crashed;
  record.reason =
      fmt::format("the process ended {} times while the case was drawn, and nothing says why", death->times);
  append(record);
}

void RecordBook::append(const Record& record) {
  store_.append(record);
  latest_.insert_or_assign(record.case_id, record);
  if (may_pass(record.status)) ++failures_[record.case_id];
}

const Record* RecordBook::find(std::string_view case_id) const {
  const auto found = latest_.find(case_id);
  return found == latest_.end() ? nullptr : &found->second;
}

bool RecordBook::is_given_up(std::string_view case_id) const {
  const Record* const record = find(case_id);
  return record != nullptr && may_pass(record->status) && failures_.find(case_id)->second >= kMostFailures;
}

bool RecordBook::is_finished(std::string_view case_id) const {
  const Record* const record = find(case_id);
  if (record == nullptr) return false;
  if (record->status == Status::ok) return true;
  return !retry_failed_ && (!may_pass(record->status) || is_given_up(case_id));
}

bool RecordBook::is_suspect(std::string_view case_id) const {
  const Record* const record = find(case_id);
  const std::optional<CaseMark::Death>& death = store_.mark().death();
  return (record != nullptr && record->status != Status::ok) || (death && death->case_id == case_id);
}

}  // namespace reliefbench
