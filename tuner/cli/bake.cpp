#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "backends/worker/remote.h"
#include "kernels/base/error.h"
#include "kernels/trace/storage_params.h"
#include "tuner/cli/commands.h"
#include "tuner/cli/format.h"
#include "tuner/cli/options.h"
#include "tuner/measure/bake_job.h"

namespace reliefbench {
namespace {

using Json = nlohmann::ordered_json;

struct BakeArguments {
  std::string heightmap;
  std::string map;
  std::string correction;
  std::string encoding = "sqrt";
  std::string format;
  std::string wrap{wrap_id(Wrap::repeat)};
  std::string max_ratio = "1";
  ReadingArguments reading;
  std::map<std::string_view, std::optional<std::string>> parameters;  ///< of map kinds, by id
  int threads = 0;
  std::string device = "cpu";
  std::optional<int> repeat{};
  std::optional<double> timeout_s;
  std::string output;
  bool verify = false;
  bool json = false;
};

std::size_t choose(std::string_view option, std::string_view value, const std::vector<std::string_view>& choices) {
  const auto found = std::find(choices.begin(), choices.end(), value);
  if (found == choices.end()) fail_input("{} {}: expected one of {}", option, value, fmt::join(choices, ", "));
  return static_cast<std::size_t>(found - choices.begin());
}

/// "--search-steps" for search_steps.
std::string option_of(std::string_view param_id) {
  std::string option = fmt::format("--{}", param_id);
  std::ranges::replace(option, '_', '-');
  return option;
}

/// text: "vulkan", or "vulkan:1" for its second device
void set_device(BakeJob& job, std::string_view text) {
  const std::size_t colon = text.find(':');
  job.device = text.substr(0, colon);
  const std::string_view index = colon == std::string_view::npos ? "0" : text.substr(colon + 1);
  const auto [end, error] = std::from_chars(index.data(), index.data() + index.size(), job.device_index);
  const bool is_number = error == std::errc() && end == index.data() + index.size() && job.device_index >= 0;
  if (!is_number || (job.device == "cpu" && colon != std::string_view::npos))
    fail_input("--device {}: expected cpu, opengl or vulkan, or the index of a device as in vulkan:1", text);
  choose("--device", job.device, {"cpu", "opengl", "vulkan"});
}

BakeJob job_of(const BakeArguments& arguments) {
  const MapRow& map = find_map(arguments.map);
  const Encoding& encoding = find_encoding(arguments.encoding);
  const Correction correction =
      arguments.correction.empty() ? default_correction(map) : find_correction(arguments.correction);
  const float max_ratio = choose("--max-ratio", arguments.max_ratio, {"1", "unbounded"}) == 0 ? 1 : kUnboundedRatio;
  const Format& format =
      arguments.format.empty() ? default_format(map, encoding, correction, max_ratio) : find_format(arguments.format);
  BakeJob job{.heightmap = {.source = arguments.heightmap},
              .spec = {.storage = {.map = map,
                                   .format = format,
                                   .encoding = encoding,
                                   .correction = correction,
                                   .max_ratio = max_ratio},
                       .wrap = find_wrap(arguments.wrap),
                       .threads = arguments.threads},
              .repeat = arguments.repeat,
              .verify = arguments.verify,
              .output = arguments.output,
              .timeout_s = arguments.timeout_s};
  set_device(job, arguments.device);
  set_reading(job.heightmap, arguments.reading);
  for (const auto& [id, text] : arguments.parameters) {
    if (!text) continue;
    const auto param = std::ranges::find(map.parameters, id, &MapParam::id);
    if (param == map.parameters.end()) fail_input("{}: a {} map has no such parameter", option_of(id), map.id);
    job.spec.parameters.push_back({.param = param->id, .value = map_param(*param).parse(*text)});
  }
  return job;
}

std::string_view verdict_id(const MapRow& map, const MapVerdict& verdict) {
  if (map.promise == MapPromise::none) return "no_promise";
  if (verdict.broken) return "broken";
  return verdict.undecided ? "undecided" : "holds";
}

Json json_of(const WorstCone& worst) { return {{"factor", worst.factor}, {"u", worst.u}, {"v", worst.v}}; }

Json json_of(const MapRow& map, const MapVerdict& verdict) {
  if (map.content == MapContent::table)
    return {{"verdict", verdict_id(map, verdict)},
            {"values", verdict.table.values},
            {"wrong", verdict.table.wrong},
            {"worst_off", verdict.table.worst_off}};
  Json out = {{"verdict", verdict_id(map, verdict)},
              {"texels", verdict.texels},
              {"texels_too_wide", verdict.texels_too_wide},
              {"worst_texel", json_of(verdict.worst_texel)}};
  if (map.is_relaxed)
    out["rays"] = {{"count", verdict.rays.rays},
                   {"crossing_twice", verdict.rays.crossing_twice},
                   {"worst", json_of(verdict.rays.worst)}};
  else
    out["cells"] = {{"count", verdict.cells.cells},   {"proved", verdict.cells.proved},
                    {"broken", verdict.cells.broken}, {"undecided", verdict.cells.undecided},
                    {"finest", verdict.cells.finest}, {"worst", json_of(verdict.cells.worst)}};
  return out;
}

void print_figures(const BakeJob& job, const BakeResult& result) {
  const MapStorage& storage = job.spec.storage;
  Json out = {{"heightmap", job.heightmap.source},
              {"map", storage.map.id},
              {"correction", correction_id(storage.correction)},
              {"encoding", storage.encoding.id},
              {"format", storage.format.id},
              {"wrap", wrap_id(job.spec.wrap)},
              {"device", job.device},
              {"width", result.width},
              {"height", result.height},
              {"time_ms", result.bake_time_ns * 1e-6}};
  if (result.pack_time_ns) out["pack_ms"] = *result.pack_time_ns * 1e-6;
  if (result.device) {
    out["device_index"] = result.device->index;
    out["device_name"] = result.device->name;
    out["driver"] = result.device->driver;
  }
  if (result.clock) {
    out["device_clock"] = {{"timer", timer_id(result.clock->timer)}, {"valid", result.clock->valid}};
    if (!result.clock->valid) out["device_clock"]["reason"] = result.clock->reason;
  }
  for (const ComputeTime& time : result.device_times) out["device_ms"][time.part] = time.ns * 1e-6;
  if (storage.map.ratios > 0) {
    out["mean_ratio"] = result.mean_ratio;
    out["closed_share"] = result.closed_share;
  }
  out["bytes"] = result.bytes;
  if (result.verdict) out["verify"] = json_of(storage.map, *result.verdict);
  out["files"] = Json::array();
  for (const auto& file : result.files) out["files"].push_back(file.string());
  print_json(out, 2);
}

std::string times_too_wide(const WorstCone& worst) {
  return worst.factor > 1 ? fmt::format(", up to {:.4g} times at uv ({:.4f}, {:.4f})", worst.factor, worst.u, worst.v)
                          : "";
}

/// Rows of the proof: what was looked at, and what was found.
std::vector<std::vector<std::string>> proof_rows(const MapRow& map, const MapVerdict& verdict) {
  if (map.content == MapContent::table)
    return {{"rays", fmt::format("{} of {} wrong; the worst is off by {} of the depth", verdict.table.wrong,
                                 verdict.table.values, format_number(verdict.table.worst_off))}};
  std::vector<std::vector<std::string>> rows;
  if (verdict.texels > 0)
    rows.push_back({"texels", fmt::format("{} of {} too wide{}", verdict.texels_too_wide, verdict.texels,
                                          times_too_wide(verdict.worst_texel))});
  const RayVerdict& rays = verdict.rays;
  const CellVerdict& cells = verdict.cells;
  if (map.is_relaxed)
    rows.push_back(
        {"rays", fmt::format("{} of {} cross twice{}", rays.crossing_twice, rays.rays, times_too_wide(rays.worst))});
  else
    rows.push_back(
        {"cells", fmt::format("{} of {} proved, {} broken, {} undecided ({} points a texel){}", cells.proved,
                              cells.cells, cells.broken, cells.undecided, cells.finest, times_too_wide(cells.worst))});
  return rows;
}

std::string verdict_text(const MapRow& map, const MapVerdict& verdict, const Paint& paint) {
  if (map.promise == MapPromise::none) return "none: the kind promises nothing";
  if (verdict.broken) return paint.bad(verdict.texels_too_wide > 0 ? "broken" : "broken between texels");
  return verdict.undecided ? "undecided" : paint.good("holds");
}

void print_text(const BakeJob& job, const BakeResult& result) {
  const MapStorage& storage = job.spec.storage;
  const Paint paint = paint_for_stdout();
  const bool has_ratios = storage.map.ratios > 0;
  std::vector<std::vector<std::string>> rows{
      {"map", fmt::format("{}{} of {}, {} x {} texels, {}", storage.map.id,
                          has_ratios ? fmt::format(" ({})", correction_id(storage.correction)) : "",
                          job.heightmap.source, result.width, result.height, wrap_id(job.spec.wrap))},
      {"time", storage.map.content == MapContent::heights
                   ? "none: heights need no baker"
                   : fmt::format("{} on {}", format_time_ns(result.bake_time_ns), job.device)}};
  if (result.device)
    rows.push_back({"device", fmt::format("{} {}: {}, {}", result.device->backend, result.device->index,
                                          result.device->name, result.device->driver)});
  for (const ComputeTime& time : result.device_times) rows.push_back({"  " + time.part, format_time_ns(time.ns)});
  if (result.clock && !result.clock->valid)
    rows.push_back({"its clock", fmt::format("{} is not believed: {}; the time is the host's",
                                             timer_id(result.clock->timer), result.clock->reason)});
  if (result.pack_time_ns)
    rows.push_back({"packed in", fmt::format("{} on cpu", format_time_ns(*result.pack_time_ns))});
  if (has_ratios)
    rows.push_back({"mean ratio", fmt::format("{}; {} % closed", format_number(result.mean_ratio),
                                              format_number(100 * result.closed_share))});
  rows.push_back({"bytes", fmt::format("{} as {}{}", format_bytes(static_cast<std::int64_t>(result.bytes)),
                                       storage.format.id, has_ratios ? fmt::format(", {}", storage.encoding.id) : "")});
  if (result.verdict) {
    for (std::vector<std::string>& row : proof_rows(storage.map, *result.verdict)) rows.push_back(std::move(row));
    rows.push_back({"guarantee", verdict_text(storage.map, *result.verdict, paint)});
  }
  for (const auto& file : result.files) rows.push_back({"written", file.string()});
  put("{}", columns(rows));
}

Exit bake_command(const BakeArguments& arguments) {
  BakeJob job = job_of(arguments);
  job.open = open_isolated;
  const BakeResult result = run_bake(job);
  print_reading(result.reading);
  arguments.json ? print_figures(job, result) : print_text(job, result);
  if (result.verdict && result.verdict->undecided) return Exit::inconclusive;
  return result.verdict && result.verdict->broken ? Exit::answer_is_no : Exit::done;
}

/// Kinds may share a parameter.
void add_map_options(CLI::App& command, std::map<std::string_view, std::optional<std::string>>& parameters) {
  std::map<std::string_view, std::string> owners;
  for (const MapRow& map : map_kinds())
    for (const MapParam& param : map.parameters)
      owners[param.id] += fmt::format("{}{}", owners[param.id].empty() ? "" : ", ", map.id);
  for (const MapRow& map : map_kinds())
    for (const MapParam& param : map.parameters)
      if (!parameters.contains(param.id))
        command.add_option(option_of(param.id), parameters[param.id],
                           fmt::format("{} only: {}", owners[param.id], param.description));
}

}  // namespace

void add_bake_command(CLI::App& app, Exit& exit_code) {
  CLI::App* command = app.add_subcommand("bake", "bake one map, prove it, write it");
  const auto arguments = std::make_shared<BakeArguments>();
  command->add_option("HEIGHTMAP", arguments->heightmap, "a file, or a name of `reliefbench list heightmaps`")
      ->required();
  command->add_option("--map", arguments->map, "kind, see `reliefbench list maps`")->required();
  command->add_option("--correction", arguments->correction, "what makes interpolated cones safe; default by kind");
  command->add_option("--encoding", arguments->encoding, "see `reliefbench list encodings`")->capture_default_str();
  command->add_option("--format", arguments->format,
                      "see `reliefbench list formats`; default: the smallest of 16 bits a channel that fits");
  command->add_option("--wrap", arguments->wrap, "repeat | clamp")->capture_default_str();
  command->add_option("--max-ratio", arguments->max_ratio, "widest cone: 1 | unbounded")->capture_default_str();
  add_map_options(*command, arguments->parameters);
  add_reading_options(*command, arguments->reading);
  command->add_option("--threads", arguments->threads, "0: all")->capture_default_str();
  command->add_option("--device", arguments->device, "cpu | opengl | vulkan; vulkan:1: its second device")
      ->capture_default_str();
  command
      ->add_option("--repeat", arguments->repeat,
                   fmt::format("bake so many times, for the median of their times; default: 1, on a GPU {}, after "
                               "one that is not timed",
                               kHardwareBakes))
      ->check(above_zero());
  command
      ->add_option("--timeout-s", arguments->timeout_s,
                   fmt::format("a band of a GPU's bake, about a second's work, that takes longer ends it; default: {}, "
                               "on a software rasteriser {}",
                               kBandLimit_s, kSoftwareBandLimit_s))
      ->check(above_zero())
      ->type_name("S");
  command->add_option("-o,--output", arguments->output, ".ktx2 (as stored), .exr (decoded) or .png");
  command->add_flag("--verify", arguments->verify, "prove the stored map: exit 1 if it breaks its kind's guarantee");
  command->add_flag("--json", arguments->json, "figures as JSON");
  command->footer(
      "Example:\n  reliefbench bake rocks --map conservative --correction safe --verify -o rocks.ktx2\n"
      "Exit: 0 done, 1 the guarantee is broken, 4 neither proved nor broken.");
  command->callback([arguments, &exit_code] { exit_code = bake_command(*arguments); });
}

}  // namespace reliefbench
