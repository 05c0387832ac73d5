#include "tuner/measure/sample_book.h"

#include <algorithm>
#include <utility>

namespace reliefbench {

SampleBook::SampleBook(RunStore& store, std::optional<Control> control) : store_(&store), control_(std::move(control)) {
  for (const Sample& sample : store.earlier().samples) enter(sample);
}

void SampleBook::append(Sample sample) {
  sample.round = static_cast<int>(samples(sample.case_id.text()).size());  // the control case has no page
  if (store_ != nullptr) store_->append(sample);
  enter(sample);
}

void SampleBook::close(const BlockState& block) {
  const bool is_held_back = !block.held_back.empty();
  if (store_ != nullptr && (is_held_back || block.before.is_told() || block.after.is_told())) store_->append(block);
  if (!is_held_back) return;
  const auto is_forgotten = [&](const Sample& sample) { return block.has(sample); };
  std::erase_if(control_samples_, is_forgotten);
  std::erase_if(waiting_, is_forgotten);
  for (auto& [id, page] : pages_) {
    size_ -= std::erase_if(page.samples, is_forgotten);  // the last that were entered
    page.times.resize(std::min(page.times.size(), page.samples.size()));
  }
}

void SampleBook::enter(const Sample& sample) {
  if (control_ && sample.case_id == control_->id) {
    control_samples_.push_back(sample);
    for (const Sample& one : waiting_)
      pages_[one.case_id].times.push_back(
          corrected_times_ns({&one, 1}, control_samples_, control_->reference_ns).front());
    waiting_.clear();
    return;
  }
  Page& entry = pages_[sample.case_id];
  entry.samples.push_back(sample);
  if (control_)
    waiting_.push_back(sample);
  else
    entry.times.push_back(sample.frame_time_ns);
  ++size_;
}

const SampleBook::Page& SampleBook::page(std::string_view case_id) const {
  static const Page kEmpty;
  const auto found = pages_.find(case_id);
  return found == pages_.end() ? kEmpty : found->second;
}

const std::vector<double>& SampleBook::times(std::string_view case_id) const { return page(case_id).times; }
const std::vector<Sample>& SampleBook::samples(std::string_view case_id) const { return page(case_id).samples; }

}  // namespace reliefbench
