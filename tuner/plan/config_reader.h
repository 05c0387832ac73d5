#pragma once
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/base/error.h"
#include "kernels/base/json_document.h"
#include "kernels/base/suggest.h"
#include "tuner/plan/config.h"

namespace reliefbench {

/// The keys of one kind of object in a config. `object` is its name in configs/schema/config.schema.json too.
struct ConfigKeys {
  /// config | scene | heightmap | view | path | light | measure | front | sweep | presets_sweep | rule | range
  std::string_view object;
  std::span<const std::string_view> keys;
};
[[nodiscard]] std::span<const ConfigKeys> config_keys();

/// What a number may be.
struct Bounds {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool above_low = false;  ///< `low` itself is not allowed
};

/// Typed access to a config's nodes. Everything throws Error(bad_input) "FILE:LINE: key 'a.b': what was expected".
class ConfigReader {
 public:
  explicit ConfigReader(std::string file) : file_(std::move(file)) {}

  [[noreturn]] void fail(const JsonNode& node, std::string_view what) const;
  /// An object with no other keys than its kind's (ConfigKeys::object).
  void check_object(const JsonNode& node, std::string_view kind) const;
  /// An object with no other keys than these.
  void check_keys(const JsonNode& node, const std::vector<std::string_view>& known) const;
  [[nodiscard]] const JsonNode& required(const JsonNode& object, std::string_view key) const;
  [[nodiscard]] std::string text(const JsonNode& node) const;
  [[nodiscard]] bool flag(const JsonNode& node) const;
  [[nodiscard]] double number(const JsonNode& node, Bounds bounds) const;
  [[nodiscard]] std::int64_t integer(const JsonNode& node, std::int64_t low, std::int64_t high) const;
  /// The items of a list that is not empty; anything else stands for a list of itself.
  [[nodiscard]] std::span<const JsonNode> items(const JsonNode& node) const;
  /// Runs `work`; an Error of it gets the node's line and key in front.
  template <typename Work>
  auto at(const JsonNode& node, Work&& work) const {
    try {
      return work();
    } catch (const Error& error) {
      fail(node, error.what());
    }
  }

 private:
  std::string file_;
};

/// All views of one entry of "scenes". folder: what relative paths start from
[[nodiscard]] std::vector<SceneSpec> read_scene(const ConfigReader& reader, const JsonNode& node,
                                                const std::filesystem::path& folder);

/// All entries of "scenes", each id once.
[[nodiscard]] std::vector<SceneSpec> read_scenes(const ConfigReader& reader, const JsonNode& node,
                                                 const std::filesystem::path& folder);
[[nodiscard]] MeasureSpec read_measure(const ConfigReader& reader, const JsonNode& node);

[[nodiscard]] SweepSpec read_sweep(const ConfigReader& reader, const JsonNode& node);

/// {"presets": FILE, "quality": [0, 50], "device": ID}: adds a sweep of one setting for each level that is meant.
/// FILE is relative to the config; without quality all levels are meant, without device (a backend's id or a device's
/// name) those of all devices.
void read_presets_sweep(const ConfigReader& reader, const JsonNode& node, Config& config);

}  // namespace reliefbench
