#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "backends/filter_audit.h"
#include "backends/timer_audit.h"
#include "backends/worker/remote.h"
#include "kernels/base/error.h"
#include "tuner/cli/commands.h"
#include "tuner/cli/format.h"
#include "tuner/cli/options.h"
#include "tuner/results/block_state.h"
#include "tuner/results/device_json.h"

namespace reliefbench {
namespace {

struct DevicesArguments {
  std::string backend;  ///< "" = every real one
  std::optional<int> device;
  bool audit = false;
  bool json = false;
};

struct Found {
  const BackendRow* backend = nullptr;
  DeviceInfo info;
  DeviceState state;                ///< now
  std::vector<TimerAudit> audit;    ///< empty where none was asked for
  std::vector<TimerAudit> compute;  ///< by the work of compute shaders, likewise; empty where the device has none
  std::vector<FilterAudit> filter;  ///< likewise
  std::string failure;              ///< why the audit could not be done, or found no timer to measure with
};

std::vector<Found> find_devices(const DevicesArguments& arguments) {
  if (!arguments.backend.empty()) (void)find_backend(arguments.backend);
  std::vector<Found> found;
  for (const BackendRow& row : backends()) {
    if (arguments.backend.empty() ? !row.real : row.id != arguments.backend) continue;
    for (const DeviceInfo& info : isolated_devices(row)) {
      if (arguments.device && info.index != *arguments.device) continue;
      found.push_back({.backend = &row,
                       .info = info,
                       .state = DeviceWatch(info).read(),
                       .audit = {},
                       .compute = {},
                       .filter = {},
                       .failure = {}});
    }
  }
  return found;
}

/// One device that cannot be audited does not hide what the others say.
void audit_device(Found& found) {
  try {
    const std::unique_ptr<Backend> backend = open_isolated(*found.backend, found.info.index);
    if (found.backend->real) found.filter = audit_filter(*backend, found.backend->dialect);
    found.audit = audit_timers(*backend, found.backend->dialect);
    found.compute = audit_timers(*backend, found.backend->dialect, true);
    (void)choose_timer(found.audit);
  } catch (const Error& error) {
    found.failure = error.what();
  }
}

void print_devices(const std::vector<Found>& devices, const Paint& paint) {
  std::vector<std::vector<std::string>> rows = {{"backend", "device", "name", "type", "driver", "api", "filter bits"}};
  for (const Found& found : devices) {
    const DeviceInfo& info = found.info;
    rows.push_back({info.backend, fmt::format("{}", info.index), paint.bold(info.name),
                    info.software ? info.type + ", software" : info.type, info.driver, info.api_version,
                    info.subtexel_bits == 0 ? "not reported" : fmt::format("{}", info.subtexel_bits)});
  }
  put("{}", columns(rows));
  for (const Found& found : devices)
    if (const std::string now = state_text(found.state); !now.empty())
      put("{} {} now: {}\n", found.info.backend, found.info.index, now);
}

std::string weight_text(const FilterPrecision& shown, int reported_bits) {
  if (shown.bits >= kMostFilterBits) return fmt::format("{} bits or more", kMostFilterBits);
  return fmt::format("{} bits, {}{}", shown.bits, shown.rounds ? "rounded" : "cut off",
                     shown.bits < reported_bits ? ": less than reported" : "");
}

void print_filter(const Found& found) {
  std::vector<std::vector<std::string>> rows = {{"texels", "filter's weight", "off by at most", "result, beside that"}};
  for (const FilterAudit& audit : found.filter)
    if (audit.refusal.empty())
      rows.push_back({std::string(texel_type_id(audit.type)), weight_text(audit.precision, found.info.subtexel_bits),
                      format_number(audit.precision.worst()), format_number(audit.precision.value)});
  if (rows.size() > 1) put("{}", columns(rows, "  "));
  for (const FilterAudit& audit : found.filter)
    if (!audit.refusal.empty()) put("  no {}: {}\n", texel_type_id(audit.type), audit.refusal);
}

/// What settings with dispatch=compute are measured with, where that is something else.
std::string of_compute(const Found& found, Timer of_fragments) {
  const std::vector<TimerAudit> both = with_compute(found.audit, found.compute);
  const auto wall = std::ranges::find(both, Timer::fenced_wall, &TimerAudit::timer);
  if (!wall->valid) return "; where a setting has dispatch=compute with nothing: its wall clock is not valid";
  const Timer timer = choose_timer(both);
  return timer == of_fragments ? "" : fmt::format("; where a setting has dispatch=compute with {}", timer_id(timer));
}

void print_audits(const std::vector<Found>& devices, const Paint& paint) {
  for (const Found& found : devices) {
    put("\n{}\n", paint.bold(fmt::format("{} {}, {}", found.info.backend, found.info.index, found.info.name)));
    std::vector<std::vector<std::string>> rows = {{"timer", "of", "verdict", "of wall", "doubling", "reason"}};
    const auto add = [&](const std::vector<TimerAudit>& audit, const std::string& work) {
      for (const TimerAudit& timer : audit)
        rows.push_back({std::string(timer_id(timer.timer)), work,
                        timer.valid ? paint.good("valid") : paint.bad("rejected"),
                        fmt::format("{:.3f}", timer.wall_ratio), fmt::format("{:.3f}", timer.doubling), timer.reason});
    };
    add(found.audit, "fragments");
    add(found.compute, "compute");
    if (!found.audit.empty()) put("{}", columns(rows, "  "));
    if (found.failure.empty()) {
      const Timer timer = choose_timer(found.audit);
      put("  measured with: {}{}\n", timer_id(timer), of_compute(found, timer));
    } else {
      put("  {}\n", paint.bad(found.failure));
    }
    print_filter(found);
  }
}

nlohmann::json devices_json(const std::vector<Found>& devices, bool audited) {
  nlohmann::json list = nlohmann::json::array();
  for (const Found& found : devices) {
    nlohmann::json entry = device_json(found.info);
    if (found.state.is_told()) entry["state"] = state_json(found.state);
    if (audited) {
      entry["audit"] = audit_json(found.audit);
      entry["audit_compute"] = audit_json(found.compute);
      entry["filter"] = filter_json(found.filter);
      entry["failure"] = found.failure;
      entry["timer"] = found.failure.empty() ? nlohmann::json(timer_id(choose_timer(found.audit))) : nlohmann::json();
    }
    list.push_back(std::move(entry));
  }
  return {{"devices", std::move(list)}};
}

Exit devices_command(const DevicesArguments& arguments) {
  std::vector<Found> devices = find_devices(arguments);
  if (devices.empty()) {
    fail_environment("no device{} on {}", arguments.device ? fmt::format(" {}", *arguments.device) : "",
                     arguments.backend.empty() ? "OpenGL (EGL) or Vulkan" : arguments.backend);
  }
  bool all_usable = true;
  if (arguments.audit) {
    for (Found& found : devices) {
      audit_device(found);
      all_usable = all_usable && found.failure.empty();
    }
  }
  if (arguments.json) {
    print_json(devices_json(devices, arguments.audit), 2);
  } else {
    const Paint paint = paint_for_stdout();
    print_devices(devices, paint);
    if (arguments.audit) print_audits(devices, paint);
  }
  return all_usable ? Exit::done : Exit::environment;
}

}  // namespace

void add_devices_command(CLI::App& app, Exit& exit_code) {
  CLI::App* command = app.add_subcommand("devices", "OpenGL and Vulkan devices, and which of their timers to believe");
  const auto arguments = std::make_shared<DevicesArguments>();
  command->add_option("--backend", arguments->backend, "opengl | vulkan | null; every real one")->type_name("ID");
  command->add_option("--device", arguments->device, "index on the backend")->type_name("INDEX");
  command->add_flag("--audit", arguments->audit,
                    "check every timer against known work and the wall clock, and how exactly the sampler weighs");
  add_json_option(*command, arguments->json);
  command->footer(
      "An audited timer is believed where it agrees with the fenced wall clock (`of wall` near 1) and doubles\n"
      "with the work (`doubling` near 2), of fragments and, for dispatch=compute, of compute shaders. The linear\n"
      "filter's weights are read off two enlarged texels of every type: what they are off by, times the\n"
      "difference of two neighbours, is what a sampled height is off by.\n"
      "Clock, temperature, power and why the clock is held back are told where driver or system know them. Exit\n"
      "code 3 where there is no device, or one has no timer to measure with.\n"
      "Example:\n  reliefbench devices --audit --backend vulkan");
  command->callback([arguments, &exit_code] { exit_code = devices_command(*arguments); });
}

}  // namespace reliefbench
