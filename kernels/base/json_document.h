#pragma once
#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace reliefbench {

/// A JSON value that knows where it stands, so that a message can name line and key.
struct JsonNode {                  // NOLINT(bugprone-exception-escape): moving a json does not throw
  std::string key;                 ///< its name in an object; "" in a list
  std::string path;                ///< "sweeps[0].axes.linear_steps"; "" at the top
  int line = 1;                    ///< from 1: of the key in an object, of the value elsewhere
  nlohmann::json value;            ///< a scalar; an empty list or object where there may be children
  std::vector<JsonNode> children;  ///< in the order of the text

  [[nodiscard]] const JsonNode* find(std::string_view child_key) const;  ///< null: no such key
};

/// Of arrays and objects within each other: values are walked, compared and copied by recursion.
inline constexpr std::size_t kJsonDepthLimit = 64;

/// Parses JSON with // and /* */ comments.
/// file: for messages only
/// throws: Error(bad_input) "FILE:LINE: ...": a syntax error, a key that stands twice in an object, deeper than
/// kJsonDepthLimit
[[nodiscard]] JsonNode parse_json_document(std::string_view text, std::string_view file);

}  // namespace reliefbench
