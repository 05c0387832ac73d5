#pragma once
#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/trace/technique.h"
#include "tuner/results/measured_device.h"
#include "tuner/results/store.h"

namespace reliefbench {

/// A case as other programs get it: what was found, not how. A run folder and its table.csv give the same rows, up to
/// the digits of the samples.
struct TableRow {
  std::string case_id;
  Settings settings;
  std::string map;
  std::string backend;
  std::string device;
  std::string driver{};   ///< as MeasuredDevice has it
  std::string machine{};  ///< likewise
  std::string scene;
  SceneKey scene_key{};  ///< unknown in tables of earlier versions: then the scene's id has to do
  Status status = Status::ok;
  std::string reason;
  std::vector<std::optional<double>> errors;  ///< parallel to metrics(); none: not defined for this case
  /// What the device's sampler is off by of the texels that the errors rest on, as CoarseFilter::error_of() gives it;
  /// 0: no more than a GPU's, or not known, as in tables of earlier versions.
  double coarse_filter = 0;
  std::int64_t memory_bytes = 0;
  double bake_time_ns = 0;
  std::optional<double> device_bake_ns{};  ///< as Record has it
  std::optional<double> first_draw_ns{};   ///< as Record has it
  std::optional<Summary> frame_time;       ///< ns a frame, as the sweep summed it up; there where status is ok
  std::optional<double> ns_per_px{};       ///< as ns_per_px() gives it; none of tables of earlier versions
  std::vector<double> samples_ns;          ///< ns a frame, corrected for drift; by time of measurement
};

[[nodiscard]] MeasuredDevice measured_device(const TableRow& row);

/// A sample as table.csv has it: five digits, as a batch's time says no more.
[[nodiscard]] double table_sample_ns(double sample_ns);

/// A case's median frame time over the pixels of its scene's frame, to hold frames of several sizes to one another; of
/// a time in ms it is ms per megapixel. None where the case has no time.
[[nodiscard]] std::optional<double> ns_per_px(const Run& run, const Record& record);

/// Every case of a run, in the run's order. throws: Error(bad_input): a record that this registry does not know
[[nodiscard]] std::vector<TableRow> case_table(const Run& run);

/// Of a run's folder, or of a table.csv that stands alone. throws: Error(bad_input): neither
[[nodiscard]] std::vector<TableRow> load_case_table(const std::filesystem::path& path);

/// table.csv (RFC 4180): a header and a row a case. Columns: case, technique, backend, device, driver, machine,
/// scene, scene_key, status, reason, map, every other parameter of the registry (blank where inactive), every metric of
/// the registry (blank where it is not defined), coarse_filter (blank where it is 0), memory_bytes, bake_time_ns,
/// device_bake_ns (blank where it was not measured), first_draw_ns (blank where nothing was compiled), median_ns,
/// mad_ns, ci_low_ns, ci_high_ns, median_ns_per_px, samples_ns (all samples, space-separated, five digits). throws:
/// Error(bad_input): a number that is not finite
void write_case_table(std::span<const TableRow> rows, std::ostream& out);

/// Reads table.csv back. A parameter, metric, driver, machine, scene key, coarse filter or time per pixel whose column
/// is missing counts as blank. throws: Error(bad_input) "FILE:LINE: column 'c': ...": not such a table, unknown
/// columns, names or values,
///         one scene with two keys
[[nodiscard]] std::vector<TableRow> parse_case_table(std::string_view text, std::string_view file);

}  // namespace reliefbench
