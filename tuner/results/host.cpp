#include "tuner/results/host.h"

#include <sys/utsname.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "git_sha.h"  // made at build time (CMakeLists.txt)

namespace reliefbench {
namespace {

/// The value behind the first line of a file that begins with `key`, without separators and quotes; "" if none.
std::string value_in(const char* path, std::string_view key) {
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    if (!line.starts_with(key)) continue;
    const std::size_t from = line.find_first_not_of(" \t:=\"", key.size());
    if (from == std::string::npos) return "";
    return line.substr(from, line.find_last_not_of(" \"") + 1 - from);
  }
  return "";
}

/// The first word of a file; "" if there is none.
std::string word_in(const std::string& path) {
  std::ifstream in(path);
  std::string word;
  in >> word;
  return word;
}

}  // namespace

std::string_view version() { return RELIEFBENCH_VERSION; }
std::string_view git_sha() { return RELIEFBENCH_GIT_SHA; }

std::string host_name() {
  std::array<char, 256> name{};
  if (gethostname(name.data(), name.size() - 1) != 0 || name.front() == '\0') return "unknown";
  return name.data();
}

nlohmann::json host_json() {
  utsname system{};
  const std::string clocks = "/sys/devices/system/cpu/cpu0/cpufreq/";
  return {{"name", host_name()},
          {"kernel", uname(&system) == 0 ? system.release : ""},
          {"cpu", value_in("/proc/cpuinfo", "model name")},
          {"governor", word_in(clocks + "scaling_governor")},
          {"max_khz", word_in(clocks + "cpuinfo_max_freq")},
          {"cores", std::thread::hardware_concurrency()},
          {"os", value_in("/etc/os-release", "PRETTY_NAME")},
          {"memory_bytes", static_cast<std::int64_t>(sysconf(_SC_PHYS_PAGES)) * sysconf(_SC_PAGE_SIZE)}};
}

}  // namespace reliefbench
