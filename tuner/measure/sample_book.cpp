#include "tuner/measure/sample_book.h"

#include <utility>

#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

constexpr std::size_t kControlWindow = 3;

}  // namespace

SampleBook::SampleBook(RunStore& store, std::string control_id, double reference_ns)
    : store_(store), control_id_(std::move(control_id)), reference_ns_(reference_ns) {
  for (const Sample& sample : store.earlier().samples) enter(sample);
}

void SampleBook::append(const Sample& sample) {
  store_.append(sample);
  enter(sample);
}

void SampleBook::enter(const Sample& sample) {
  if (sample.case_id == control_id_) {
    last_control_.push_back(sample.frame_time_ns);
    if (last_control_.size() > kControlWindow) last_control_.pop_front();
    return;
  }
  double time_ns = sample.frame_time_ns;
  if (!last_control_.empty())
    time_ns *= reference_ns_ / median(std::vector(last_control_.begin(), last_control_.end()));
  Page& entry = pages_[sample.case_id];
  entry.times.push_back(time_ns);
  entry.samples.push_back(sample);
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
