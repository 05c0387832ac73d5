// States as the kernel's drivers tell them: amdgpu (hwmon, pp_dpm_sclk), i915 and xe (frequencies and throttle
// reasons of the GT), cpufreq, and the processor's thermal_throttle and hwmon.
#include <fcntl.h>
#include <fmt/format.h>
#include <glob.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>

#include "backends/backend.h"
#include "backends/device_state.h"
#include "kernels/base/trimmed.h"

namespace reliefbench {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongestFile_bytes = 1024;

/// "" where it cannot be read, or is longer than such files are.
std::string file_text(const fs::path& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0) return {};
  std::array<char, kLongestFile_bytes> buffer{};
  const ssize_t size = ::read(fd, buffer.data(), buffer.size());
  ::close(fd);
  if (size <= 0 || static_cast<std::size_t>(size) == buffer.size()) return {};
  return {buffer.data(), static_cast<std::size_t>(size)};
}

/// A file that is one number.
std::optional<double> one_number(std::string_view text) {
  text = trimmed(text);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

/// Lines such as "1: 2475Mhz *": the greatest.
std::optional<double> greatest_level(std::string_view text) {
  constexpr std::string_view kUnit = "mhz";
  std::optional<double> greatest;
  while (!text.empty()) {
    const std::string_view line = trimmed(text.substr(0, text.find('\n')));
    text.remove_prefix(std::min(text.find('\n'), text.size() - 1) + 1);
    const std::size_t colon = line.find(':');
    if (colon == std::string_view::npos) continue;
    std::string_view level = trimmed(line.substr(colon + 1));
    level = trimmed(level.substr(0, level.find('*')));
    if (level.size() <= kUnit.size()) continue;
    const std::string_view unit = level.substr(level.size() - kUnit.size());
    if (!std::ranges::equal(unit, kUnit, {}, [](unsigned char c) { return std::tolower(c); })) continue;
    const std::optional<double> value = one_number(level.substr(0, level.size() - kUnit.size()));
    if (value) greatest = std::max(greatest.value_or(0), *value);
  }
  return greatest;
}

using Value = std::optional<double> DeviceState::*;

/// Files that tell one quantity, or one reason. Of several the greatest counts, or their sum.
struct FileRow {
  std::string_view pattern;  ///< below the device's folder, as glob(3) has it, with braces
  Value value = nullptr;     ///< null: a reason
  double scale = 1;          ///< from the file's unit
  std::string_view reason{};
  bool adds = false;
  std::string_view chips{};  ///< of these only: what the file "name" beside it may hold, with blanks round each
  std::optional<double> (*parse)(std::string_view) = one_number;
};

constexpr std::array kPciRows = {
    FileRow{.pattern = "hwmon/hwmon*/freq1_input", .value = &DeviceState::clock_mhz, .scale = 1e-6},
    FileRow{.pattern = "{drm/card*/gt_act_freq_mhz,tile*/gt*/freq0/act_freq}", .value = &DeviceState::clock_mhz},
    FileRow{.pattern = "pp_dpm_sclk", .value = &DeviceState::clock_max_mhz, .parse = greatest_level},
    FileRow{.pattern = "{drm/card*/gt_RP0_freq_mhz,tile*/gt*/freq0/rp0_freq}", .value = &DeviceState::clock_max_mhz},
    FileRow{.pattern = "drm/card*/gt_max_freq_mhz", .value = &DeviceState::clock_max_mhz},
    FileRow{.pattern = "hwmon/hwmon*/temp1_input", .value = &DeviceState::temperature_c, .scale = 1e-3},
    FileRow{.pattern = "hwmon/hwmon*/power1_average", .value = &DeviceState::power_w, .scale = 1e-6},
    FileRow{.pattern = "hwmon/hwmon*/power1_input", .value = &DeviceState::power_w, .scale = 1e-6},
    FileRow{.pattern = "{drm/card*/gt/gt*/throttle_,tile*/gt*/freq0/throttle/}"
                       "reason_{thermal,prochot,ratl,vr_thermalert}",
            .reason = kThermalSlowdown},
    FileRow{.pattern = "{drm/card*/gt/gt*/throttle_,tile*/gt*/freq0/throttle/}reason_{pl1,pl2,pl4,vr_tdc}",
            .reason = kPowerCap},
};

// Clocks of ten cores tell as much as those of a hundred; a slowdown may be any core's.
constexpr std::array kProcessorRows = {
    FileRow{.pattern = "devices/system/cpu/cpu[0-9]/cpufreq/scaling_cur_freq",
            .value = &DeviceState::clock_mhz,
            .scale = 1e-3},
    FileRow{.pattern = "devices/system/cpu/cpu[0-9]/cpufreq/cpuinfo_max_freq",
            .value = &DeviceState::clock_max_mhz,
            .scale = 1e-3},
    FileRow{.pattern = "devices/system/cpu/cpu[0-9]*/thermal_throttle/{core,package}_throttle_count",
            .value = &DeviceState::throttle_events,
            .adds = true},
    FileRow{.pattern = "class/hwmon/hwmon*/temp1_input",
            .value = &DeviceState::temperature_c,
            .scale = 1e-3,
            .chips = " coretemp k10temp "},
};

std::vector<fs::path> found_files(const fs::path& folder, const FileRow& row) {
  std::vector<fs::path> files;
  glob_t found{};
  if (::glob((folder / row.pattern).c_str(), GLOB_BRACE | GLOB_NOSORT, nullptr, &found) == 0) {
    files.reserve(found.gl_pathc);
    for (std::size_t i = 0; i < found.gl_pathc; ++i) files.emplace_back(found.gl_pathv[i]);
  }
  ::globfree(&found);
  if (!row.chips.empty())
    std::erase_if(files, [&](const fs::path& file) {
      const std::string chip = file_text(file.parent_path() / "name");
      return trimmed(chip).empty() || row.chips.find(fmt::format(" {} ", trimmed(chip))) == std::string_view::npos;
    });
  return files;
}

class FileReader final : public StateReader {
 public:
  FileReader(const fs::path& folder, std::span<const FileRow> rows) {
    for (const FileRow& row : rows)
      if (auto files = found_files(folder, row); !files.empty()) found_.push_back({&row, std::move(files)});
  }
  [[nodiscard]] bool is_empty() const { return found_.empty(); }

  void read(DeviceState& state) override {
    for (const auto& [row, files] : found_) {
      if (row->value != nullptr && state.*row->value) continue;
      std::optional<double> whole;
      for (const fs::path& file : files) {
        const std::optional<double> value = row->parse(file_text(file));
        if (!value) continue;
        whole = row->adds ? whole.value_or(0) + *value : std::max(whole.value_or(*value), *value);
      }
      if (!whole) continue;
      if (row->value != nullptr)
        enter_value(state, row->value, *whole * row->scale);
      else if (*whole == 1)  // these files hold 0 or 1
        state.held_back.emplace(row->reason);
    }
  }

 private:
  struct Found {
    const FileRow* row;
    std::vector<fs::path> files;
  };
  std::vector<Found> found_;
};

std::unique_ptr<StateReader> reader_of(const fs::path& folder, std::span<const FileRow> rows) {
  auto reader = std::make_unique<FileReader>(folder, rows);
  if (reader->is_empty()) return nullptr;
  return reader;
}

}  // namespace

std::unique_ptr<StateReader> open_pci_files(const DeviceInfo& device, const StatePlaces& places) {
  if (device.pci.empty() || device.pci.find_first_not_of("0123456789abcdef:.") != std::string::npos) return nullptr;
  return reader_of(places.sysfs / "bus/pci/devices" / device.pci, kPciRows);
}

std::unique_ptr<StateReader> open_processor_files(const DeviceInfo& device, const StatePlaces& places) {
  if (device.type != "cpu") return nullptr;
  return reader_of(places.sysfs, kProcessorRows);
}

}  // namespace reliefbench
