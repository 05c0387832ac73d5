#include <algorithm>
#include <set>

#include "kernels/base/error.h"
#include "tuner/plan/config_reader.h"

namespace reliefbench {
namespace {

/// A parameter's value: a choice's name, which may look like a number (4 sectors), or an integer in range.
int read_value(const ConfigReader& reader, const JsonNode& node, const Param& param) {
  if (param.choices.empty()) return static_cast<int>(reader.integer(node, param.min, param.max));
  const std::string text = node.value.is_number_integer() ? node.value.dump() : reader.text(node);
  const auto found = std::ranges::find(param.choices, text);
  if (found == param.choices.end())
    reader.fail(node, fmt::format("'{}' is {}", text, unknown_text(text, param.choices)));
  return static_cast<int>(found - param.choices.begin());
}

/// {"from": 8, "to": 128, "times": 2} or {"from": 0, "to": 10, "step": 5}; "to" itself is in if it is met.
std::vector<int> read_range(const ConfigReader& reader, const JsonNode& node, const Param& param) {
  if (!param.choices.empty())
    reader.fail(node,
                fmt::format("'{}' has named values, no range (known: {})", param.id, fmt::join(param.choices, ", ")));
  reader.check_object(node, "range");
  const JsonNode* times = node.find("times");
  const JsonNode* step = node.find("step");
  if ((times == nullptr) == (step == nullptr)) reader.fail(node, "expected either 'times' or 'step'");
  const JsonNode& start = reader.required(node, "from");
  const std::int64_t from = reader.integer(start, param.min, param.max);
  const std::int64_t to = reader.integer(reader.required(node, "to"), from, param.max);
  if (times != nullptr && from < 1) reader.fail(start, "a range with 'times' starts at 1 or more");
  const std::int64_t factor = times != nullptr ? reader.integer(*times, 2, 1000) : 1;
  const std::int64_t addend = step != nullptr ? reader.integer(*step, 1, param.max) : 0;
  std::vector<int> values;
  for (std::int64_t value = from; value <= to; value = value * factor + addend)
    values.push_back(static_cast<int>(value));
  return values;
}

std::vector<int> read_values(const ConfigReader& reader, const JsonNode& node, const Param& param) {
  if (node.value.is_object()) return read_range(reader, node, param);
  std::vector<int> values;
  for (const JsonNode& item : reader.items(node)) values.push_back(read_value(reader, item, param));
  return values;
}

const Param& find_param(const ConfigReader& reader, const JsonNode& node, const Technique& technique,
                        std::string_view id) {
  if (const Param* param = technique.find(id)) return *param;
  std::vector<std::string_view> known;
  for (const Param& param : technique.params) known.push_back(param.id);
  if (known.empty()) reader.fail(node, fmt::format("unknown ('{}' has no parameters)", technique.id));
  reader.fail(node, unknown_text(id, known));
}

/// The parameters of an axis: "a", or linked ones "a,b".
std::vector<const Param*> read_params(const ConfigReader& reader, const JsonNode& node, const Technique& technique) {
  std::vector<const Param*> params;
  const std::string_view names = node.key;
  for (std::size_t begin = 0; begin <= names.size();) {
    const std::size_t end = std::min(names.find(',', begin), names.size());
    std::string_view name = names.substr(begin, end - begin);
    name.remove_prefix(std::min(name.find_first_not_of(' '), name.size()));
    name = name.substr(0, name.find_last_not_of(' ') + 1);
    params.push_back(&find_param(reader, node, technique, name));
    begin = end + 1;
  }
  return params;
}

Axis read_axis(const ConfigReader& reader, const JsonNode& node, const Technique& technique) {
  const std::vector<const Param*> params = read_params(reader, node, technique);
  Axis axis;
  for (const Param* param : params) axis.params.emplace_back(param->id);
  if (params.size() == 1) {
    for (const int value : read_values(reader, node, *params[0])) axis.values.push_back({value});
    return axis;
  }
  for (const JsonNode& tuple : reader.items(node)) {
    if (!tuple.value.is_array() || tuple.children.size() != params.size())
      reader.fail(tuple, fmt::format("expected a list of {} values: {}", params.size(), fmt::join(axis.params, ", ")));
    std::vector<int> values;
    for (std::size_t i = 0; i < params.size(); ++i) values.push_back(read_value(reader, tuple.children[i], *params[i]));
    axis.values.push_back(std::move(values));
  }
  return axis;
}

void read_axes(const ConfigReader& reader, const JsonNode& node, SweepSpec& sweep) {
  if (!node.value.is_object()) reader.fail(node, fmt::format("expected an object, not {}", node.value.type_name()));
  std::set<std::string> seen;
  std::size_t zip_length = 1;
  for (const JsonNode& child : node.children) {
    Axis axis = read_axis(reader, child, *sweep.technique);
    for (const std::string& param : axis.params)
      if (!seen.insert(param).second) reader.fail(child, fmt::format("parameter '{}' is in two axes", param));
    // An axis of one value goes with every step of a zip.
    const std::size_t length = axis.values.size();
    if (sweep.zip && length != 1 && zip_length != 1 && length != zip_length)
      reader.fail(child,
                  fmt::format("has {} values, an axis before it {}: a zip needs the same number", length, zip_length));
    zip_length = std::max(zip_length, length);
    sweep.axes.push_back(std::move(axis));
  }
}

std::vector<std::pair<std::string, std::vector<int>>> read_terms(const ConfigReader& reader, const JsonNode& node,
                                                                 const Technique& technique) {
  if (!node.value.is_object()) reader.fail(node, fmt::format("expected an object, not {}", node.value.type_name()));
  std::vector<std::pair<std::string, std::vector<int>>> terms;
  for (const JsonNode& child : node.children)
    terms.emplace_back(child.key, read_values(reader, child, find_param(reader, child, technique, child.key)));
  return terms;
}

const Technique& read_technique(const ConfigReader& reader, const JsonNode& node) {
  const std::string id = reader.text(node);
  return *reader.at(node, [&] { return &find_technique(id); });
}

}  // namespace

SweepSpec read_sweep(const ConfigReader& reader, const JsonNode& node) {
  reader.check_object(node, "sweep");
  SweepSpec sweep;
  sweep.line = node.line;
  const JsonNode& technique = reader.required(node, "technique");
  sweep.technique = &read_technique(reader, technique);
  if (const JsonNode* combine = node.find("combine")) {
    const std::string text = reader.text(*combine);
    if (text != "product" && text != "zip")
      reader.fail(*combine, fmt::format("'{}' is {}", text, unknown_text(text, {"product", "zip"})));
    sweep.zip = text == "zip";
  }
  if (const JsonNode* axes = node.find("axes")) read_axes(reader, *axes, sweep);
  if (const JsonNode* where = node.find("where"))
    for (const JsonNode& rule : reader.items(*where)) {
      reader.check_object(rule, "rule");
      sweep.where.push_back({.when = read_terms(reader, reader.required(rule, "if"), *sweep.technique),
                             .then = read_terms(reader, reader.required(rule, "then"), *sweep.technique)});
    }
  return sweep;
}

}  // namespace reliefbench
