#pragma once
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tuner/results/record.h"

namespace reliefbench {

/// Name of a backend's control case in samples.jsonl.
[[nodiscard]] std::string control_case_id(std::string_view backend);

/// By time of measurement, the parts of a merged run one after the other: machines that ran at once share no course.
[[nodiscard]] bool is_drawn_before(const Sample& a, const Sample& b);

/// The samples of a run by case id, each list in the order of is_drawn_before().
using SamplesByCase = std::map<std::string, std::vector<Sample>, std::less<>>;
[[nodiscard]] SamplesByCase group_samples(std::span<const Sample> samples);

/// The control samples of a part of a merged run; none where it has none.
/// control: in the order of is_drawn_before()
[[nodiscard]] std::span<const Sample> control_of_part(std::span<const Sample> control, int part);

/// Frame times as measured, ns.
[[nodiscard]] std::vector<double> raw_times(std::span<const Sample> samples);

/// A backend's control times, ns. Those of a merged run's parts are brought to the mean speed of its hosts, since which
/// of these drew which part says nothing of any.
/// info: run.json
[[nodiscard]] std::vector<double> control_times_ns(const nlohmann::json& info, std::string_view backend,
                                                   std::span<const Sample> control);

/// Each sample's frame time divided by the median of the control samples round it in time, two before and one after, so
/// that what slows both (clock rates, other tenants of the machine) cancels. It looks ahead no further than the next
/// control sample, so that a search may use a sample once that is drawn: nothing later changes it.
/// In a merged run only control samples of a sample's own part count; where that has none, those of all parts alike.
/// samples, control: in the order of is_drawn_before(); control not empty
[[nodiscard]] std::vector<double> relative_times(std::span<const Sample> samples, std::span<const Sample> control);

/// A case's frame times corrected for drift: relative_times() at the speed that the device had when the run began.
/// reference_ns: the control case's time then (run.json, "control_reference_ns")
/// returns: ns a frame, in the samples' order
[[nodiscard]] std::vector<double> corrected_times_ns(std::span<const Sample> samples, std::span<const Sample> control,
                                                     double reference_ns);

/// A case's time: the summary of its corrected_times_ns(), beside the median as measured. timer: its id
[[nodiscard]] FrameTime frame_time(std::span<const Sample> samples, std::span<const Sample> control,
                                   double reference_ns, std::string_view timer);

}  // namespace reliefbench
