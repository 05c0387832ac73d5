// Values for a technique's parameters, and what follows from them.
#include <algorithm>
#include <charconv>

#include "kernels/base/error.h"
#include "kernels/trace/technique.h"

namespace reliefbench {
namespace {

bool is_on(const Settings& settings, std::string_view param_id) {
  const Param* const param = settings.technique().find(param_id);
  return param != nullptr && settings.is_active(*param);
}

}  // namespace

Settings::Settings(const Technique& technique) : technique_(&technique) {
  for (const Param& param : technique.params) values_.push_back(param.fallback);
}

void Settings::set(std::string_view param_id, int value) {
  const Param* param = technique_->find(param_id);
  if (param == nullptr) fail_input("technique '{}' has no parameter '{}'", technique_->id, param_id);
  if (value < param->min || value > param->max)
    fail_input("{}={} is out of range (expected {} to {})", param_id, value, param->min, param->max);
  values_[static_cast<std::size_t>(param - technique_->params.data())] = value;
}

void Settings::set(std::string_view param_id, std::string_view text) {
  const Param* param = technique_->find(param_id);
  if (param == nullptr) fail_input("technique '{}' has no parameter '{}'", technique_->id, param_id);
  if (param->choices.empty()) {
    int value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size())
      fail_input("{}='{}' is not an integer", param_id, text);
    set(param_id, value);
    return;
  }
  const auto found = std::find(param->choices.begin(), param->choices.end(), text);
  if (found == param->choices.end())
    fail_input("{}='{}' is unknown (expected one of {})", param_id, text, fmt::join(param->choices, ", "));
  set(param_id, static_cast<int>(found - param->choices.begin()));
}

int Settings::get(std::string_view param_id) const {
  const Param* param = technique_->find(param_id);
  if (param == nullptr) fail_input("technique '{}' has no parameter '{}'", technique_->id, param_id);
  return is_active(*param) ? values_[static_cast<std::size_t>(param - technique_->params.data())] : param->fallback;
}

std::string_view Settings::choice(std::string_view param_id) const {
  const int value = get(param_id);
  return technique_->find(param_id)->choices.at(static_cast<std::size_t>(value));
}

bool Settings::is_active(const Param& param) const {
  if (param.active_if.empty()) return true;
  const std::size_t split = param.active_if.find('=');
  const std::string_view condition = param.active_if.substr(0, split);
  return is_active(*technique_->find(condition)) && choice(condition) == param.active_if.substr(split + 1);
}

std::string Settings::text() const {
  std::string out;
  for (std::size_t i = 0; i < values_.size(); ++i) {
    const Param& param = technique_->params[i];
    if (is_active(param)) out += fmt::format("{}{}={}", out.empty() ? "" : "&", param.id, param.text(values_[i]));
  }
  return out;
}

const MapRow& map_of(const Settings& settings) {
  const Technique& technique = settings.technique();
  const Param* const param = technique.find("map");
  if (param == nullptr || !settings.is_active(*param)) return find_map(technique.maps.front());
  return find_map(settings.choice("map"));
}

Guarantee guarantee_of(const Settings& settings) {
  const auto guarantee = settings.technique().guarantee_when;
  return guarantee == nullptr ? Guarantee::none : guarantee(settings);
}

MapStorage storage_of(const Settings& settings) {
  const auto choice_or = [&](std::string_view id, std::string_view otherwise) {
    return is_on(settings, id) ? settings.choice(id) : otherwise;
  };
  return {.map = map_of(settings),
          .format = find_format(settings.choice("format")),
          .encoding = find_encoding(choice_or("encoding", "ratio")),
          .correction = find_correction(choice_or("correction", "none")),
          .max_ratio = choice_or("max_ratio", "1") == "unbounded" ? kUnboundedRatio : 1};
}

std::string conflict(const Settings& settings) {
  return is_on(settings, "format") ? conflict(storage_of(settings)) : "";
}

}  // namespace reliefbench
