#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "kernels/base/error.h"
#include "tuner/history/connection.h"
#include "tuner/results/json_text.h"

namespace reliefbench {
namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";  // U+FFFD

}  // namespace

std::string storable(const std::string& text) {
  if (std::ranges::all_of(text, [](char c) { return c > 0; })) return text;
  // The JSON library knows what is UTF-8.
  const std::string quoted = json_text(nlohmann::json(text), -1);
  std::string clean = nlohmann::json::parse(quoted).get<std::string>();
  for (std::size_t at = 0; (at = clean.find('\0', at)) != std::string::npos;) clean.replace(at, 1, kReplacement);
  return clean;
}

std::string stored_samples(const std::vector<double>& samples) { return fmt::format("[{}]", fmt::join(samples, ",")); }

std::vector<double> parse_samples(const std::string& text) {
  std::vector<double> samples;
  const char* const end = text.data() + text.size();
  for (const char* at = text.data() + 1; at < end - 1;) {
    double& sample = samples.emplace_back();
    const auto [next, error] = std::from_chars(at, end, sample);
    if (error != std::errc()) fail_input("samples of the history are damaged: '{}'", text.substr(0, 60));
    at = next + 1;
  }
  return samples;
}

}  // namespace reliefbench
