#include "tuner/results/relative_time.h"

#include <algorithm>

#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

constexpr std::size_t kNearest = 3;

/// The control samples nearest to a time: a run of neighbours, since they are sorted by time.
std::span<const Sample> nearest_control(std::span<const Sample> control, double at_ns) {
  const auto after = std::lower_bound(control.begin(), control.end(), at_ns,
                                      [](const Sample& sample, double time) { return sample.at_ns < time; });
  auto first = static_cast<std::size_t>(after - control.begin());
  std::size_t last = first;  // half open
  while (last - first < std::min(kNearest, control.size())) {
    const bool take_earlier =
        last == control.size() || (first > 0 && at_ns - control[first - 1].at_ns <= control[last].at_ns - at_ns);
    if (take_earlier) {
      --first;
    } else {
      ++last;
    }
  }
  return control.subspan(first, last - first);
}

}  // namespace

std::string control_case_id(std::string_view backend) { return "control@" + std::string(backend); }

SamplesByCase group_samples(std::span<const Sample> samples) {
  SamplesByCase result;
  for (const Sample& sample : samples) result[sample.case_id].push_back(sample);
  for (auto& [id, list] : result) {
    std::stable_sort(list.begin(), list.end(), [](const Sample& a, const Sample& b) { return a.at_ns < b.at_ns; });
  }
  return result;
}

std::vector<double> raw_times(std::span<const Sample> samples) {
  std::vector<double> times;
  for (const Sample& sample : samples) times.push_back(sample.frame_time_ns);
  return times;
}

std::vector<double> relative_times(std::span<const Sample> samples, std::span<const Sample> control) {
  std::vector<double> times;
  for (const Sample& sample : samples) {
    times.push_back(sample.frame_time_ns / median(raw_times(nearest_control(control, sample.at_ns))));
  }
  return times;
}

std::vector<double> corrected_times_ns(std::span<const Sample> samples, std::span<const Sample> control,
                                       double reference_ns) {
  std::vector<double> times = relative_times(samples, control);
  for (double& time : times) time *= reference_ns;
  return times;
}

}  // namespace reliefbench
