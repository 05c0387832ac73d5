#include "tuner/results/run_shape.h"

#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

using nlohmann::json;

enum class Type { text, number, boolean, object, array };

struct Key {
  std::string_view path;  ///< parts between dots; "*": every element of a list
  Type type;
};

// configs/schema/run.schema.json says more; this is what code relies on.
constexpr std::array kKeys = {
    Key{"identity", Type::object},
    Key{"identity.devices", Type::array},
    Key{"identity.devices.*", Type::object},
    Key{"identity.devices.*.backend", Type::text},
    Key{"identity.devices.*.name", Type::text},
    Key{"identity.devices.*.driver", Type::text},
    Key{"name", Type::text},
    Key{"version", Type::text},
    Key{"git_sha", Type::text},
    Key{"started", Type::text},
    Key{"started_unix_ns", Type::number},
    Key{"host", Type::object},
    Key{"host.cpu", Type::text},
    Key{"host.os", Type::text},
    Key{"config_path", Type::text},
    Key{"bisected", Type::boolean},
    Key{"devices", Type::array},
    Key{"devices.*", Type::object},
    Key{"devices.*.backend", Type::text},
    Key{"devices.*.index", Type::number},
    Key{"devices.*.name", Type::text},
    Key{"devices.*.driver", Type::text},
    Key{"devices.*.timer", Type::text},
    Key{"devices.*.control_load_steps", Type::number},
    Key{"devices.*.control_frames", Type::number},
    Key{"devices.*.control_reference_ns", Type::number},
    Key{"front", Type::object},
    Key{"front.error", Type::text},
    Key{"front.constraints", Type::array},
    Key{"front.constraints.*", Type::text},
    Key{"budgets", Type::array},
    Key{"budgets.*", Type::text},
};

bool is(const json& value, Type type) {
  switch (type) {
    case Type::text:
      return value.is_string();
    case Type::number:
      return value.is_number();
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
  constexpr std::array<std::string_view, 5> kNames = {"a string", "a number", "true or false", "an object", "a list"};
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
  for (const Key& key : kKeys) check(info, key.path, key.type, "", path);
}

}  // namespace reliefbench
