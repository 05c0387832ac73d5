#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <ostream>
#include <set>

#include "kernels/base/error.h"
#include "kernels/base/rounding.h"
#include "tuner/plan/registry_params.h"
#include "tuner/results/case_table.h"
#include "tuner/results/csv.h"

namespace reliefbench {
namespace {

/// Columns before the parameters, and after the metrics.
constexpr std::string_view kLeading[] = {"case",  "technique", "backend", "device", "driver", "machine",
                                         "scene", "scene_key", "status",  "reason", "map"};
constexpr std::string_view kTrailing[] = {"coarse_filter", "memory_bytes",     "bake_time_ns", "device_bake_ns",
                                          "first_draw_ns", "median_ns",        "mad_ns",       "ci_low_ns",
                                          "ci_high_ns",    "median_ns_per_px", "samples_ns"};
constexpr std::string_view kSceneKeyColumn = "scene_key";
constexpr std::string_view kCoarseFilterColumn = "coarse_filter";
constexpr std::string_view kDeviceBakeColumn = "device_bake_ns";
constexpr std::string_view kFirstDrawColumn = "first_draw_ns";
constexpr std::string_view kPerPixelColumn = "median_ns_per_px";
/// Those that tables of earlier versions lack.
constexpr std::string_view kLater[] = {"driver",          "machine",      kSceneKeyColumn, kCoarseFilterColumn,
                                       kDeviceBakeColumn, kPerPixelColumn};
constexpr std::string_view kMapColumn = "map";  // the map that the case ran on; where it is a parameter, its value

std::vector<std::string> param_columns() {
  std::vector<std::string> ids;
  for (const RegistryParam& param : registry_params())
    if (param.id != kMapColumn) ids.emplace_back(param.id);
  return ids;
}

std::vector<std::string> columns() {
  std::vector<std::string> names(std::begin(kLeading), std::end(kLeading));
  for (const std::string& id : param_columns()) names.push_back(id);
  for (const MetricRow& metric : metrics()) names.emplace_back(metric.id);
  names.insert(names.end(), std::begin(kTrailing), std::end(kTrailing));
  return names;
}

/// The shortest text that reads back as the same number.
std::string number_text(double value, const TableRow& row, std::string_view column) {
  if (!std::isfinite(value)) fail_input("case '{}': {} is {}, which no file may hold", row.case_id, column, value);
  return fmt::format("{}", value);
}

std::string samples_text(const TableRow& row) {
  std::string text;
  for (const double sample : row.samples_ns) {
    if (!text.empty()) text += ' ';
    text += number_text(table_sample_ns(sample), row, "samples_ns");
  }
  return text;
}

std::vector<std::string> cells_of(const TableRow& row, std::span<const std::string> params) {
  std::vector<std::string> cells = {row.case_id,
                                    std::string(row.settings.technique().id),
                                    row.backend,
                                    row.device,
                                    row.driver,
                                    row.machine,
                                    row.scene,
                                    row.scene_key.hex,
                                    std::string(status_id(row.status)),
                                    row.reason,
                                    row.map};
  for (const std::string& id : params) {
    const Param* const param = row.settings.active(id);
    cells.push_back(param != nullptr ? param->text(row.settings.get(id)) : "");
  }
  for (std::size_t i = 0; i < metrics().size(); ++i)
    cells.push_back(row.errors[i] ? number_text(*row.errors[i], row, metrics()[i].id) : "");
  cells.push_back(row.coarse_filter > 0 ? number_text(row.coarse_filter, row, kCoarseFilterColumn) : "");
  cells.push_back(fmt::format("{}", row.memory_bytes));
  cells.push_back(number_text(row.bake_time_ns, row, "bake_time_ns"));
  cells.push_back(row.device_bake_ns ? number_text(*row.device_bake_ns, row, kDeviceBakeColumn) : "");
  cells.push_back(row.first_draw_ns ? number_text(*row.first_draw_ns, row, kFirstDrawColumn) : "");
  const Summary time = row.frame_time.value_or(Summary{});
  for (const double value : {time.median, time.mad, time.ci_low, time.ci_high})
    cells.push_back(row.frame_time ? number_text(value, row, "frame time") : "");
  cells.push_back(row.ns_per_px ? number_text(*row.ns_per_px, row, kPerPixelColumn) : "");
  cells.push_back(samples_text(row));
  return cells;
}

/// A row of the file, its cells by column.
class Cells {
 public:
  Cells(const CsvRow& row, const std::map<std::string, std::size_t, std::less<>>& columns, std::string_view file)
      : row_(row), columns_(columns), file_(file) {}

  [[noreturn]] void fail(std::string_view column, std::string_view what) const {
    fail_input("{}:{}: column '{}': {}", file_, row_.line, column, what);
  }
  /// Blank where the file has no such column.
  [[nodiscard]] const std::string& text(std::string_view column) const {
    static const std::string blank;
    const auto found = columns_.find(column);
    return found == columns_.end() ? blank : row_.cells[found->second];
  }
  [[nodiscard]] double number(std::string_view column) const { return parse<double>(column, text(column)); }
  [[nodiscard]] std::int64_t integer(std::string_view column) const {
    return parse<std::int64_t>(column, text(column));
  }
  [[nodiscard]] std::optional<double> optional_number(std::string_view column) const {
    return text(column).empty() ? std::nullopt : std::optional(number(column));
  }
  [[nodiscard]] std::vector<double> numbers(std::string_view column) const {
    std::vector<double> values;
    std::string_view rest = text(column);
    while (!rest.empty()) {
      const std::size_t end = std::min(rest.find(' '), rest.size());
      values.push_back(parse<double>(column, rest.substr(0, end)));
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    return values;
  }
  /// Runs `work`; an Error of it gets file, line and column in front.
  template <typename Work>
  decltype(auto) at(std::string_view column, Work&& work) const {
    try {
      return work();
    } catch (const Error& error) {
      fail(column, error.what());
    }
  }

 private:
  template <typename Number>
  Number parse(std::string_view column, std::string_view word) const {
    Number value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc{} || end != word.data() + word.size() || !std::isfinite(static_cast<double>(value)))
      fail(column, fmt::format("'{}' is not {}", word, std::is_integral_v<Number> ? "an integer" : "a number"));
    return value;
  }

  const CsvRow& row_;
  const std::map<std::string, std::size_t, std::less<>>& columns_;
  std::string_view file_;
};

Settings settings_in(const Cells& cells, std::span<const std::string> params) {
  const Technique& technique = *cells.at("technique", [&] { return &find_technique(cells.text("technique")); });
  Settings settings(technique);
  // In the row's order, where a condition stands before what it switches on.
  for (const Param& param : technique.params) {
    const std::string& text = cells.text(param.id);
    if (!settings.is_active(param)) continue;
    if (text.empty() && !param.is_spelt_out) continue;
    if (text.empty()) cells.fail(param.id, fmt::format("is blank, but '{}' needs it", technique.id));
    cells.at(param.id, [&] { settings.set(param.id, text); });
  }
  for (const std::string& id : params)
    if (!cells.text(id).empty() && settings.active(id) == nullptr)
      cells.fail(id,
                 fmt::format("is '{}', but means nothing with these settings of '{}'", cells.text(id), technique.id));
  return settings;
}

TableRow row_in(const Cells& cells, std::span<const std::string> params) {
  TableRow row{.case_id = cells.text("case"),
               .settings = settings_in(cells, params),
               .map = cells.text(kMapColumn),
               .backend = cells.text("backend"),
               .device = cells.text("device"),
               .driver = cells.text("driver"),
               .machine = cells.text("machine"),
               .scene = cells.text("scene"),
               .scene_key = cells.at(kSceneKeyColumn, [&] { return parse_scene_key(cells.text(kSceneKeyColumn)); }),
               .status = cells.at("status", [&] { return parse_status(cells.text("status")); }),
               .reason = cells.text("reason"),
               .errors = {},
               .coarse_filter = cells.optional_number(kCoarseFilterColumn).value_or(0),
               .memory_bytes = cells.integer("memory_bytes"),
               .bake_time_ns = cells.number("bake_time_ns"),
               .device_bake_ns = cells.optional_number(kDeviceBakeColumn),
               .first_draw_ns = cells.optional_number(kFirstDrawColumn),
               .frame_time = std::nullopt,
               .ns_per_px = cells.optional_number(kPerPixelColumn),
               .samples_ns = cells.numbers("samples_ns")};
  for (const MetricRow& metric : metrics()) row.errors.push_back(cells.optional_number(metric.id));
  if (cells.optional_number("median_ns"))
    row.frame_time = Summary{.median = cells.number("median_ns"),
                             .mad = cells.number("mad_ns"),
                             .ci_low = cells.number("ci_low_ns"),
                             .ci_high = cells.number("ci_high_ns"),
                             .n = static_cast<int>(row.samples_ns.size())};
  if (row.status == Status::ok && !row.frame_time) cells.fail("median_ns", "is blank, but the case is ok");
  return row;
}

}  // namespace

double table_sample_ns(double sample_ns) { return rounded_to_digits(sample_ns, 5); }

void write_case_table(std::span<const TableRow> rows, std::ostream& out) {
  const std::vector<std::string> params = param_columns();
  out << csv_line(columns());
  for (const TableRow& row : rows) out << csv_line(cells_of(row, params));
}

std::vector<TableRow> parse_case_table(std::string_view text, std::string_view file) {
  const std::vector<CsvRow> lines = parse_csv(text, file);
  if (lines.empty()) fail_input("{}:1: is empty, not a table of cases", file);
  const std::vector<std::string> known = columns();
  std::map<std::string, std::size_t, std::less<>> places;
  for (std::size_t i = 0; i < lines[0].cells.size(); ++i) {
    const std::string& name = lines[0].cells[i];
    if (std::ranges::find(known, name) == known.end()) fail_input("{}:1: column '{}': unknown", file, name);
    if (!places.emplace(name, i).second) fail_input("{}:1: column '{}': stands twice", file, name);
  }
  for (const auto& fixed : {std::span<const std::string_view>(kLeading), std::span<const std::string_view>(kTrailing)})
    for (const std::string_view name : fixed)
      if (!places.contains(name) && std::ranges::find(kLater, name) == std::end(kLater))
        fail_input("{}:1: column '{}': is missing", file, name);

  const std::vector<std::string> params = param_columns();
  std::vector<TableRow> rows;
  std::set<std::string_view> seen;
  std::map<std::string, SceneKey> keys;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const Cells cells(lines[i], places, file);
    rows.push_back(row_in(cells, params));
    if (!seen.insert(lines[i].cells[places["case"]]).second)
      cells.fail("case", fmt::format("'{}' stands twice", rows.back().case_id));
    const SceneKey& key = rows.back().scene_key;
    if (const SceneKey& first = keys.try_emplace(rows.back().scene, key).first->second; first != key)
      cells.fail(kSceneKeyColumn, fmt::format("two scenes are called '{}': {}, and here {}", rows.back().scene,
                                              first.short_text(), key.short_text()));
  }
  return rows;
}

}  // namespace reliefbench
