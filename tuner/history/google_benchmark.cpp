#include "tuner/history/google_benchmark.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "kernels/base/append_file.h"
#include "kernels/base/error.h"
#include "kernels/base/json_file.h"
#include "kernels/base/sha256.h"
#include "tuner/history/moment.h"
#include "tuner/history/standard_error.h"
#include "tuner/results/host.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

using nlohmann::json;

/// The text with `null` for NaN and Infinity, with their signs, between strings.
std::string without_non_numbers(std::string_view text) {
  std::string clean;
  clean.reserve(text.size());
  for (std::size_t i = 0; i < text.size();) {
    std::size_t end = i + 1;
    if (text[i] == '"') {
      while (end < text.size() && text[end] != '"') end += text[end] == '\\' ? 2 : 1;
      end = std::min(end + 1, text.size());
    }
    const std::size_t sign = text[i] == '-' ? 1 : 0;
    for (const std::string_view word : {"NaN", "nan", "Infinity", "inf"})
      if (text.substr(i + sign).starts_with(word)) {
        end = i + sign + word.size();
        clean += "null";
        i = end;
        break;
      }
    clean += text.substr(i, end - i);
    i = end;
  }
  return clean;
}

const json* find_in(const json& object, const char* key) {
  const auto found = object.find(key);
  return found == object.end() ? nullptr : &*found;
}

std::string string_in(const json& object, const char* key) {
  const json* value = find_in(object, key);
  return value != nullptr && value->is_string() ? value->get<std::string>() : "";
}

/// A finite number, or nothing.
std::optional<double> number_in(const json& object, const char* key) {
  const json* value = find_in(object, key);
  if (value == nullptr || !value->is_number() || !std::isfinite(value->get<double>())) return std::nullopt;
  return value->get<double>();
}

bool is_true(const json& object, const char* key) {
  const json* value = find_in(object, key);
  return value != nullptr && value->is_boolean() && value->get<bool>();
}

double ns_per_unit(std::string_view unit) {
  if (unit == "us") return 1e3;
  if (unit == "ms") return 1e6;
  return unit == "s" ? 1e9 : 1;
}

/// What a benchmark's entry holds beside its measured numbers.
constexpr std::array<std::string_view, 8> kNoMetrics = {"family_index", "per_family_instance_index",
                                                        "repetitions",  "repetition_index",
                                                        "threads",      "iterations",
                                                        "real_time",    "cpu_time"};

/// One number of a benchmark in a file.
struct MeasuredNumber {
  std::vector<std::optional<double>> repetitions{};  ///< none: not finite
  std::map<std::string, double> aggregates{};
  bool is_time = false;
};

/// A benchmark of a file: all entries with its name.
struct Benchmark {
  std::map<std::string, MeasuredNumber> metrics{};
  std::string trouble{};  ///< "error" or "skipped"
  int aggregated = 0;     ///< repetitions that the aggregates are of
};

void add_number(const json& entry, const std::string& key, double factor, bool is_time, Benchmark& benchmark) {
  MeasuredNumber& metric = benchmark.metrics[key];
  metric.is_time = is_time;
  std::optional<double> value = number_in(entry, key.c_str());
  if (value) *value *= factor;
  if (string_in(entry, "run_type") != "aggregate") return metric.repetitions.push_back(value);
  if (value) metric.aggregates[string_in(entry, "aggregate_name")] = *value;
}

/// Adds what an entry says to its benchmark.
void add_entry(const json& entry, Benchmark& benchmark) {
  if (is_true(entry, "error_occurred")) benchmark.trouble = "error";
  if (is_true(entry, "skipped")) benchmark.trouble = "skipped";
  if (string_in(entry, "aggregate_unit") == "percentage") return;  // coefficients of variation
  if (string_in(entry, "run_type") == "aggregate")
    benchmark.aggregated = static_cast<int>(std::clamp(number_in(entry, "repetitions").value_or(0), 0.0, 1e6));
  const double factor = ns_per_unit(string_in(entry, "time_unit"));
  for (const char* key : {"real_time", "cpu_time"})
    if (entry.contains(key)) add_number(entry, key, factor, /*is_time=*/true, benchmark);
  for (const auto& [key, value] : entry.items())
    if ((value.is_number() || value.is_null()) && std::ranges::find(kNoMetrics, key) == kNoMetrics.end())
      add_number(entry, key, 1, /*is_time=*/false, benchmark);
}

/// Where the time is set by hand, as a GPU's is, no time of the CPU is measured: 0 throughout.
void drop_unmeasured(Benchmark& benchmark) {
  const auto cpu_time = benchmark.metrics.find("cpu_time");
  if (cpu_time == benchmark.metrics.end()) return;
  bool is_measured = false;
  for (const std::optional<double>& value : cpu_time->second.repetitions) is_measured |= value != 0.0;
  for (const auto& [name, value] : cpu_time->second.aggregates) is_measured |= value != 0.0;
  if (!is_measured) benchmark.metrics.erase(cpu_time);
}

std::optional<double> aggregate(const MeasuredNumber& metric, const std::string& name) {
  const auto found = metric.aggregates.find(name);
  return found == metric.aggregates.end() ? std::nullopt : std::optional(found->second);
}

RepetitionRow row_of(const Benchmark& benchmark, const MeasuredNumber& metric) {
  RepetitionRow row;
  row.status = benchmark.trouble.empty() ? "ok" : benchmark.trouble;
  for (const std::optional<double>& value : metric.repetitions) {
    if (value) row.samples.push_back(*value);
    if (!value && row.status == "ok") row.status = "not_finite";
  }
  if (!row.samples.empty()) {
    const Summary summary = summarise(row.samples);
    row.median = summary.median;
    row.mad = summary.mad;
    row.n = summary.n;
  } else if (const auto middle = aggregate(metric, aggregate(metric, "median") ? "median" : "mean")) {
    constexpr double kMadPerSigma = 1 / 1.4826;  // of a normal distribution
    row.median = *middle;
    row.mad = kMadPerSigma * aggregate(metric, "stddev").value_or(0);
    row.n = std::max(1, benchmark.aggregated);
  } else if (row.status == "ok") {
    row.status = "not_finite";
  }
  row.value = row.median;
  row.is_valid = row.status == "ok" && row.value > 0;
  if (row.is_valid) row.standard_error = log_median_error(row.median, row.mad, row.n);
  return row;
}

SeriesRow series_of(const std::string& name, const std::string& metric_id, const MeasuredNumber& metric) {
  SeriesRow series;
  series.setting = series.case_id = name;
  series.technique = name.substr(0, name.find('/'));
  series.metric = metric_id;
  series.unit = metric.is_time ? "ns" : "";
  series.lower_is_better = !metric_id.ends_with("per_second");
  return series;
}

/// What of the context would change times by itself.
json environment_of(const json& context) {
  json environment = json::object();
  for (const char* key : {"host_name", "num_cpus", "cpu_scaling_enabled", "aslr_enabled", "caches", "library_version",
                          "library_build_type"})
    if (const json* value = find_in(context, key)) environment[key] = *value;
  constexpr double kMostMhz = 1e6;
  if (const auto mhz = number_in(context, "mhz_per_cpu"); mhz && std::abs(*mhz) < kMostMhz)
    environment["mhz_per_cpu"] = 100 * std::llround(*mhz / 100);
  return environment;
}

/// An aggregate's name without "_median" and the like, where there is no run_name.
std::string name_of(const json& entry) {
  const std::string run_name = string_in(entry, "run_name");
  return run_name.empty() ? string_in(entry, "name") : run_name;
}

}  // namespace

json parse_tolerant_json(std::string_view text, const std::string& file) {
  check_json_depth(text, file);
  const std::string clean = without_non_numbers(text);
  try {
    return json::parse(clean);
  } catch (const json::parse_error& error) {
    const auto end = clean.begin() + static_cast<std::ptrdiff_t>(std::min(error.byte, clean.size()));
    fail_input("{}:{}: not JSON", file, 1 + std::count(clean.begin(), end, '\n'));
  } catch (const json::out_of_range&) {
    fail_input("{}: a number is too large to be read", file);
  }
}

Night read_google_benchmark(const std::filesystem::path& path, std::optional<std::int64_t> unix_s) {
  const std::string text = read_file(path);
  const json document = parse_tolerant_json(text, path.string());
  const json* context = document.is_object() ? find_in(document, "context") : nullptr;
  const json* entries = document.is_object() ? find_in(document, "benchmarks") : nullptr;
  if (context == nullptr || !context->is_object() || entries == nullptr || !entries->is_array())
    fail_input("{}: expected a run's folder, or Google Benchmark's JSON with 'context' and 'benchmarks'",
               path.string());

  std::vector<std::string> names;  // in the file's order
  std::map<std::string, Benchmark> benchmarks;
  for (const json& entry : *entries) {
    const std::string name = entry.is_object() ? name_of(entry) : "";
    if (name.empty()) fail_input("{}: key 'benchmarks[{}]': has no name", path.string(), &entry - &entries->front());
    if (const std::string of = string_in(entry, "aggregate_name"); of == "BigO" || of == "RMS") continue;
    const auto [place, is_new] = benchmarks.try_emplace(name);
    if (is_new) names.push_back(name);
    add_entry(entry, place->second);
  }

  Night night;
  night.run.content = sha256(text);
  night.run.kind = "google-benchmark";
  night.run.machine = string_in(*context, "host_name");
  if (night.run.machine.empty()) night.run.machine = host_name();
  night.run.health = json::object();
  night.run.unix_s =
      unix_s ? *unix_s : parse_moment(string_in(*context, "date"), path.string() + ": key 'context.date'");
  night.environment = environment_of(*context);
  for (const std::string& name : names) {
    Benchmark& benchmark = benchmarks.at(name);
    drop_unmeasured(benchmark);
    if (benchmark.metrics.empty()) night.skipped.push_back(fmt::format("{}: has no number", name));
    for (const auto& [id, metric] : benchmark.metrics) {
      night.values.push_back({.series = series_of(name, id, metric), .row = row_of(benchmark, metric), .score = {}});
      night.values.back().series.machine = night.run.machine;
    }
  }
  return night;
}

}  // namespace reliefbench
