#include "kernels/base/json_file.h"

#include <algorithm>
#include <string>
#include <string_view>

#include "kernels/base/append_file.h"
#include "kernels/base/error.h"
#include "kernels/base/json_document.h"

namespace reliefbench {
namespace {

std::size_t depth_of(std::string_view json_text) {
  std::size_t depth = 0;
  std::size_t deepest = 0;
  bool is_in_text = false;
  for (std::size_t i = 0; i < json_text.size(); ++i) {
    const char c = json_text[i];
    if (c == '"') is_in_text = !is_in_text;
    if (is_in_text && c == '\\') ++i;
    if (is_in_text) continue;
    if (c == '[' || c == '{') deepest = std::max(deepest, ++depth);
    if ((c == ']' || c == '}') && depth > 0) --depth;
  }
  return deepest;
}

}  // namespace

void check_json_depth(std::string_view text, std::string_view name) {
  if (depth_of(text) > kJsonDepthLimit) fail_input("{}: over {} levels deep", name, kJsonDepthLimit);
}

nlohmann::json read_json(const std::filesystem::path& path) {
  const std::string text = read_file(path);
  check_json_depth(text, path.string());
  nlohmann::json value = nlohmann::json::parse(text, nullptr, false);
  if (value.is_discarded()) fail_input("{}: torn, or not JSON", path.string());
  return value;
}

}  // namespace reliefbench
