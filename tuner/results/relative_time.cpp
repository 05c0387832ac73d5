#include "tuner/results/relative_time.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <tuple>

#include "tuner/results/device_json.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

constexpr std::ptrdiff_t kBefore = 2;

/// The control samples round a sample in time.
std::span<const Sample> control_round(std::span<const Sample> all, const Sample& sample) {
  const std::span<const Sample> control = control_of_part(all, sample.part);
  if (control.empty()) return all;
  const auto after = std::ranges::lower_bound(control, sample.at_ns, {}, &Sample::at_ns);
  const auto before = std::min(kBefore, after - control.begin());
  return {after - before, after == control.end() ? after : after + 1};
}

}  // namespace

bool is_drawn_before(const Sample& a, const Sample& b) { return std::tie(a.part, a.at_ns) < std::tie(b.part, b.at_ns); }

std::string control_case_id(std::string_view backend) { return "control@" + std::string(backend); }

SamplesByCase group_samples(std::span<const Sample> samples) {
  SamplesByCase result;
  for (const Sample& sample : samples) result[sample.case_id].push_back(sample);
  for (auto& [id, list] : result) std::ranges::stable_sort(list, is_drawn_before);
  return result;
}

std::span<const Sample> control_of_part(std::span<const Sample> control, int part) {
  const auto begin = std::ranges::lower_bound(control, part, {}, &Sample::part);
  const auto end = std::ranges::upper_bound(control, part, {}, &Sample::part);
  return {begin, end};
}

std::vector<double> raw_times(std::span<const Sample> samples) {
  std::vector<double> times;
  for (const Sample& sample : samples) times.push_back(sample.frame_time_ns);
  return times;
}

std::vector<double> control_times_ns(const nlohmann::json& info, std::string_view backend,
                                     std::span<const Sample> control) {
  std::vector<double> own_ns;  // by part; 0: it does not tell
  std::map<std::string, std::vector<double>> of_host;
  const nlohmann::json parts = info.value("parts", nlohmann::json::array());
  for (const nlohmann::json& part : parts) {
    own_ns.push_back(control_reference_ns(part, backend));
    if (own_ns.back() > 0) of_host[part.value(nlohmann::json::json_pointer("/host/name"), "")].push_back(own_ns.back());
  }
  std::vector<double> times_ns = raw_times(control);
  if (of_host.empty()) return times_ns;
  std::vector<double> hosts_ns;
  hosts_ns.reserve(of_host.size());
  for (const auto& [host, host_ns] : of_host) hosts_ns.push_back(geometric_mean(host_ns));
  const double mean_ns = geometric_mean(hosts_ns);
  for (std::size_t i = 0; i < times_ns.size(); ++i) {
    const auto part = static_cast<std::size_t>(control[i].part);
    if (part < own_ns.size() && own_ns[part] > 0) times_ns[i] *= mean_ns / own_ns[part];
  }
  return times_ns;
}

std::vector<double> relative_times(std::span<const Sample> samples, std::span<const Sample> control) {
  std::vector<double> times;
  for (const Sample& sample : samples) {
    times.push_back(sample.frame_time_ns / median(raw_times(control_round(control, sample))));
  }
  return times;
}

std::vector<double> corrected_times_ns(std::span<const Sample> samples, std::span<const Sample> control,
                                       double reference_ns) {
  std::vector<double> times = relative_times(samples, control);
  for (double& time : times) time *= reference_ns;
  return times;
}

FrameTime frame_time(std::span<const Sample> samples, std::span<const Sample> control, double reference_ns,
                     std::string_view timer) {
  return {.summary = summarise(corrected_times_ns(samples, control, reference_ns)),
          .raw_median = median(raw_times(samples)),
          .timer = std::string(timer)};
}

}  // namespace reliefbench
