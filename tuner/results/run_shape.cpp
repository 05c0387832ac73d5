#include "tuner/results/run_shape.h"

#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "kernels/base/clock.h"
#include "kernels/base/error.h"

namespace reliefbench {
namespace {

using nlohmann::json;

enum class Type { text, number, moment, boolean, object, array };

struct KnownKey {
  std::string_view path;  ///< parts between dots; "*": every element of a list
  Type type;
};

// configs/schema/run.schema.json says more; this is what code relies on.
constexpr std::array kKeys = {
    KnownKey{"identity", Type::object},
    KnownKey{"identity.devices", Type::array},
    KnownKey{"identity.devices.*", Type::object},
    KnownKey{"identity.devices.*.backend", Type::text},
    KnownKey{"identity.devices.*.name", Type::text},
    KnownKey{"identity.devices.*.driver", Type::text},
    KnownKey{"identity.filter", Type::text},
    KnownKey{"identity.case", Type::text},
    KnownKey{"identity.shard", Type::text},
    KnownKey{"parts", Type::array},
    KnownKey{"parts.*", Type::object},
    KnownKey{"parts.*.folder", Type::text},
    KnownKey{"parts.*.cases", Type::number},
    KnownKey{"parts.*.records", Type::number},
    KnownKey{"parts.*.identity", Type::object},
    KnownKey{"parts.*.identity.filter", Type::text},
    KnownKey{"parts.*.identity.case", Type::text},
    KnownKey{"parts.*.identity.shard", Type::text},
    KnownKey{"parts.*.identity.devices", Type::array},
    KnownKey{"parts.*.identity.devices.*", Type::object},
    KnownKey{"parts.*.identity.devices.*.backend", Type::text},
    KnownKey{"parts.*.host", Type::object},
    KnownKey{"parts.*.host.name", Type::text},
    KnownKey{"parts.*.devices", Type::array},
    KnownKey{"parts.*.devices.*", Type::object},
    KnownKey{"parts.*.devices.*.backend", Type::text},
    KnownKey{"parts.*.devices.*.control_reference_ns", Type::number},
    KnownKey{"counts", Type::object},
    KnownKey{"counts.cases", Type::number},
    KnownKey{"wall_s", Type::object},
    KnownKey{"name", Type::text},
    KnownKey{"version", Type::text},
    KnownKey{"git_sha", Type::text},
    KnownKey{"started", Type::text},
    KnownKey{"started_unix_ns", Type::moment},
    KnownKey{"host", Type::object},
    KnownKey{"host.cpu", Type::text},
    KnownKey{"host.os", Type::text},
    KnownKey{"host.name", Type::text},
    KnownKey{"config_path", Type::text},
    KnownKey{"bisected", Type::boolean},
    KnownKey{"devices", Type::array},
    KnownKey{"devices.*", Type::object},
    KnownKey{"devices.*.backend", Type::text},
    KnownKey{"devices.*.index", Type::number},
    KnownKey{"devices.*.name", Type::text},
    KnownKey{"devices.*.driver", Type::text},
    KnownKey{"devices.*.timer", Type::text},
    KnownKey{"devices.*.control_load_steps", Type::number},
    KnownKey{"devices.*.control_frames", Type::number},
    KnownKey{"devices.*.control_reference_ns", Type::number},
    KnownKey{"devices.*.frame_fill", Type::array},
    KnownKey{"devices.*.frame_fill.*", Type::object},
    KnownKey{"devices.*.frame_fill.*.frame_px", Type::array},
    KnownKey{"devices.*.frame_fill.*.pixel_cost", Type::number},
    KnownKey{"devices.*.control_state", Type::object},
    KnownKey{"devices.*.states", Type::object},
    KnownKey{"devices.*.states.clock_mhz", Type::array},
    KnownKey{"devices.*.states.temperature_c", Type::array},
    KnownKey{"devices.*.states.power_w", Type::array},
    KnownKey{"devices.*.states.held_back", Type::array},
    KnownKey{"front", Type::object},
    KnownKey{"front.error", Type::text},
    KnownKey{"front.constraints", Type::array},
    KnownKey{"front.constraints.*", Type::text},
    KnownKey{"budgets", Type::array},
    KnownKey{"budgets.*", Type::text},
};

bool is(const json& value, Type type) {
  switch (type) {
    case Type::text:
      return value.is_string();
    case Type::number:
      return value.is_number();
    case Type::moment:
      return value.is_number() && value >= 0 && value < kMostUnixSeconds * 1e9;
    case Type::boolean:
      return value.is_boolean();
    case Type::object:
      return value.is_object();
    case Type::array:
      return value.is_array();
  }
  return false;
}

std::string_view name_of(Type type) {
  constexpr std::array<std::string_view, 6> kNames = {
      "a string", "a number", "nanoseconds since 1970, before the year 10000", "true or false", "an object", "a list"};
  return kNames.at(static_cast<std::size_t>(type));
}

/// rest: of the key's path, below `value`; place: of `value`, as a message names it
void check(const json& value, std::string_view rest, Type type, const std::string& place,
           const std::filesystem::path& path) {
  if (rest.empty()) {
    if (!is(value, type)) fail_input("{}: key '{}': expected {}", path.string(), place, name_of(type));
    return;
  }
  const std::size_t dot = rest.find('.');
  const std::string part(rest.substr(0, dot));
  const std::string_view below = dot == std::string_view::npos ? std::string_view() : rest.substr(dot + 1);
  if (part == "*") {
    for (std::size_t i = 0; i < value.size(); ++i) check(value[i], below, type, fmt::format("{}[{}]", place, i), path);
  } else if (const auto found = value.find(part); found != value.end()) {
    check(*found, below, type, place.empty() ? part : place + "." + part, path);
  }
}

}  // namespace

void check_run_shape(const json& info, const std::filesystem::path& path) {
  for (const KnownKey& key : kKeys) check(info, key.path, key.type, "", path);
}

}  // namespace reliefbench
