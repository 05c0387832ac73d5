#include "tuner/results/run_summary.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <set>

#include "kernels/base/atomic_file.h"
#include "kernels/base/embedded.h"
#include "kernels/base/sha256.h"
#include "kernels/judge/reference.h"
#include "kernels/maps/map_kind.h"
#include "kernels/trace/shader_contract.h"
#include "kernels/trace/technique.h"
#include "tuner/decide/pareto.h"
#include "tuner/decide/recommend.h"
#include "tuner/measure/harness.h"
#include "tuner/measure/prepare.h"
#include "tuner/results/case_table.h"
#include "tuner/results/device_json.h"
#include "tuner/results/host.h"
#include "tuner/results/run_files.h"
#include "tuner/results/t4.h"

namespace reliefbench {
namespace {

std::vector<std::string> texts(const std::vector<Budget>& budgets) {
  std::vector<std::string> out;
  out.reserve(budgets.size());
  for (const Budget& budget : budgets) out.push_back(budget.text());
  return out;
}

std::vector<std::string> command_line() {
  std::vector<std::string> arguments;
  std::string text;
  if (FILE* file = std::fopen("/proc/self/cmdline", "rb"); file != nullptr) {
    for (int c = std::fgetc(file); c != EOF; c = std::fgetc(file)) text += static_cast<char>(c);
    std::fclose(file);
  }
  for (std::size_t from = 0; from < text.size();) {
    const std::size_t to = std::min(text.find('\0', from), text.size());
    arguments.push_back(text.substr(from, to - from));
    from = to + 1;
  }
  return arguments;
}

}  // namespace

std::string kernels_sha256() {
  std::string text = fmt::format("harness {} tracer {}\n", kHarnessVersion, ReferenceTracer::kVersion);
  for (const MapRow& row : map_kinds()) text += fmt::format("{} {}\n", row.id, row.version);
  text += shared_contract();
  for (const Technique& technique : techniques()) text += parameters_contract(technique);
  for (const EmbeddedFile& file : embedded_shaders()) text += fmt::format("{}\n{}\n", file.name, file.text);
  return sha256(text);
}

std::string config_sha256(const Config& config) {
  return sha256(fmt::format("{}{}", config.text, fmt::join(config.included, "")));
}

nlohmann::json device_identity(const DeviceInfo& device) {
  return {{"backend", device.backend}, {"index", device.index}, {"name", device.name}, {"driver", device.driver}};
}

double unix_ns() {
  return std::chrono::duration<double, std::nano>(std::chrono::system_clock::now().time_since_epoch()).count();
}

std::string utc_text(double time_ns) {
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(static_cast<std::time_t>(time_ns * 1e-9)));
}

nlohmann::json device_json(const Session& session) {
  nlohmann::json device = device_json(session.device());
  device["audit"] = audit_json(session.audit());
  const Calibration& calibration = session.calibration();
  device["timer"] = timer_id(calibration.timer);
  device["control_load_steps"] = calibration.load_steps;
  device["control_frames"] = calibration.frames;
  device["control_reference_ns"] = calibration.reference_ns;
  return device;
}

std::optional<Calibration> known_calibration(const nlohmann::json& info, const DeviceInfo& device) {
  for (const nlohmann::json& entry : info.value("devices", nlohmann::json::array())) {
    if (entry.value("backend", "") != device.backend) continue;
    for (const Timer timer : device.timers)
      if (timer_id(timer) == entry.at("timer").get<std::string>())
        return Calibration{.timer = timer,
                           .load_steps = entry.at("control_load_steps"),
                           .frames = entry.at("control_frames"),
                           .reference_ns = entry.at("control_reference_ns")};
  }
  return std::nullopt;
}

nlohmann::json run_info(const Config& config, const std::vector<nlohmann::json>& devices, const SweepSummary& summary,
                        double started_ns, bool finished) {
  nlohmann::json wall_s = {{"other", summary.other_s}, {"total", summary.total_s}};
  for (std::size_t i = 0; i < kPartIds.size(); ++i) wall_s[std::string(kPartIds.at(i))] = summary.part_s.at(i);
  nlohmann::json info = {{"name", config.name},
                         {"version", version()},
                         {"git_sha", git_sha()},
                         {"argv", command_line()},
                         {"started", utc_text(started_ns)},
                         {"started_unix_ns", started_ns},
                         {"host", host_json()},
                         {"config_path", config.path.string()},
                         {"config", nlohmann::json::parse(config.text, nullptr, true, /*ignore_comments=*/true)},
                         {"seed", config.seed},
                         {"devices", devices},
                         {"wall_s", wall_s},
                         {"counts",
                          {{"cases", summary.cases},
                           {"resumed", summary.resumed},
                           {"statuses", summary.statuses},
                           {"bakes", summary.bakes},
                           {"bakes_cached", summary.bakes_cached},
                           {"references", summary.references},
                           {"references_cached", summary.references_cached},
                           {"shaders", summary.shaders}}},
                         {"front", {{"error", config.front_error}, {"constraints", texts(config.front_constraints)}}},
                         {"budgets", texts(config.budgets)}};
  info["finished"] = finished ? nlohmann::json(utc_text(unix_ns())) : nlohmann::json(nullptr);
  return info;
}

void write_results(const Config& config, const Run& run) {
  const std::vector<Front> all = fronts(run.records, config.front_error, config.front_constraints);
  write_atomically(run.folder / kFrontFile, fronts_json(all).dump(1) + "\n");
  write_atomically(run.folder / kBenchmarkFile, benchmark_json(run.samples));
  const std::vector<TableRow> table = case_table(run);
  write_atomically(run.folder / kTableFile, case_table_csv(table));
  write_atomically(
      run.folder / kT4File,
      t4_json(run, table, config.front_constraints).dump(1, ' ', false, nlohmann::json::error_handler_t::replace) +
          "\n");

  std::set<std::filesystem::path> kept;
  const auto keep = [&](const Record* record) {
    if (record == nullptr) return;
    for (const char* kind : {"frame", "error"}) kept.insert(run.folder / image_path(record->case_id, kind));
    kept.insert(run.folder / image_path(reference_image_key(record->scene, record->backend), "frame"));
  };
  for (const Front& front : all)
    for (const FrontPoint& point : front.points) keep(point.record);
  for (const Answer& answer : recommend(run.records, {.budgets = config.budgets, .error_metric = config.front_error}))
    for (const Record* record : {answer.pick, answer.runner_up, answer.simplest, answer.flat, answer.nearest})
      keep(record);
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(run.folder / "images", ignored))
    if (!kept.contains(entry.path())) std::filesystem::remove(entry.path(), ignored);
}

}  // namespace reliefbench
