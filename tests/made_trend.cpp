#include "tests/made_trend.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "kernels/base/rounding.h"

namespace reliefbench {
namespace {

using nlohmann::json;

constexpr std::size_t kNone = static_cast<std::size_t>(-1);
constexpr double kNoise = 0.009;             // of a night's log value
constexpr std::int64_t kFirst = 1792900800;  // 2026-10-25
constexpr std::int64_t kDay_s = 86400;

std::string utc(std::int64_t unix_s) { return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(unix_s)); }
std::string hex(std::uint64_t number, int digits) { return fmt::format("{:016x}", number).substr(0, digits); }
double five_digits(double value) { return rounded_to_digits(value, 5); }

struct Traits {
  std::string technique, map, format, scene, backend;
  std::size_t machine = 0;
};

Traits traits_of(std::size_t i, std::size_t machines) {
  constexpr std::array kTechniques = {"relaxed_cone", "cone", "quad_cone", "interval", "relief", "parallax", "qdm"};
  constexpr std::array kMaps = {"conservative", "po07", "quick"};
  constexpr std::array kFormats = {"rg8", "rg16"};
  constexpr std::array kScenes = {"rocks/oblique", "rocks/grazing", "brick/oblique", "brick/grazing", "spikes/top"};
  Traits traits{.technique = kTechniques[i % 7],
                .map = kMaps[i / 7 % 3],
                .format = kFormats[i / 21 % 2],
                .scene = kScenes[i / 42 % 5],
                .backend = i / 210 % 2 == 0 ? "vulkan" : "opengl"};
  traits.machine = machines > 1 && i % 4 == 3 ? 1 : 0;
  return traits;
}

/// What happens, and to whom; nights are counted on the machine.
struct Happening {
  json event;  ///< without what follows from the rest
  std::size_t machine = 0;
  double share = 0;  ///< of the time
  double from = 0;   ///< share of the nights
  std::size_t width = 1;
  bool (*moves)(const Traits&) = nullptr;
};

bool is_drift(const Happening& happening) { return happening.event["kind"] == "drift"; }

std::vector<Happening> happenings() {
  const auto states = [](std::initializer_list<std::array<const char*, 3>> rows) {
    json list = json::array();
    for (const auto& [state, by, text] : rows) list.push_back({{"state", state}, {"by", by}, {"text", text}});
    return list;
  };
  return {
      {.event = {{"kind", "slower"},
                 {"what", "vulkan technique=relaxed_cone"},
                 {"q", 1e-9},
                 {"states", states({{"suspect", "check", "seen for 4 nights"},
                                    {"confirmed", "confirm", "a re-run of both commits shows 5.1 %"}})}},
       .share = 0.052,
       .from = 0.68,
       .moves = [](const Traits& t) { return t.technique == "relaxed_cone" && t.backend == "vulkan"; }},
      {.event = {{"kind", "faster"},
                 {"what", "map=po07"},
                 {"q", 2e-6},
                 {"states", states({{"suspect", "check", "seen for 4 nights"},
                                    {"confirmed", "check", "3 more nights hold it"}})}},
       .share = -0.038,
       .from = 0.4,
       .width = 2,
       .moves = [](const Traits& t) { return t.map == "po07"; }},
      {.event = {{"kind", "slower"},
                 {"what", "vulkan technique=qdm scene=rocks/grazing"},
                 {"q", 0.021},
                 {"states", states({{"suspect", "check", "seen for 4 nights; wants a re-run"}})}},
       .share = 0.027,
       .from = 0.88,
       .width = 2,
       .moves = [](const Traits& t) { return t.technique == "qdm" && t.scene == "rocks/grazing"; }},
      {.event = {{"kind", "drift"},
                 {"what", "opengl technique=quad_cone"},
                 {"q", 0.012},
                 {"states", states({{"suspect", "check", "no step explains it"}})}},
       .share = 0.03,
       .from = 1,
       .moves = [](const Traits& t) { return t.technique == "quad_cone" && t.backend == "opengl"; }},
      {.event = {{"kind", "errors"},
                 {"what", "technique=relief"},
                 {"q", nullptr},
                 {"text", "e_xy.p99 0.81 to 0.93 texels, missed_rate 0.0021 to 0.0034"},
                 {"states", states({{"suspect", "check", "deterministic results changed"},
                                    {"confirmed", "check", "the same on 2 nights"}})}},
       .from = 0.75,
       .moves = [](const Traits& t) { return t.technique == "relief"; }},
      {.event = {{"kind", "slower"},
                 {"what", "vulkan"},
                 {"q", 1e-12},
                 {"text", "same shaders, new driver, and the control case moved by 6.1 %"},
                 {"states",
                  states({{"suspect", "check", ""}, {"environment", "check", "the control case moved along"}})}},
       .machine = 1,
       .share = 0.061,
       .from = 0.55,
       .moves = [](const Traits& t) { return t.backend == "vulkan"; }},
      {.event = {{"kind", "slower"},
                 {"what", "technique=interval format=rg16"},
                 {"q", 0.04},
                 {"states", states({{"suspect", "check", ""}, {"cleared", "confirm", "a re-run did not show it"}})}},
       .share = 0.004,
       .from = 0.5,
       .moves = [](const Traits& t) { return t.technique == "interval" && t.format == "rg16"; }},
      {.event = {{"kind", "slower"},
                 {"what", "technique=parallax"},
                 {"q", 1e-7},
                 {"states", states({{"suspect", "check", ""},
                                    {"confirmed", "check", "3 more nights hold it"},
                                    {"accepted", "ann", "the price of the exact silhouette"}})}},
       .share = 0.031,
       .from = 0.22,
       .moves = [](const Traits& t) { return t.technique == "parallax"; }},
  };
}

class TrendMaker {
 public:
  explicit TrendMaker(const MadeTrendOptions& options) : options_(options), random_(options.seed) {
    if (options.eventful && options.nights >= 20)
      for (Happening& happening : happenings())
        if (happening.machine < options.machines) happenings_.push_back(std::move(happening));
  }

  json make() {
    json series = json::array();
    std::vector<json> moved(happenings_.size(), json::array());
    for (std::size_t i = 0; i < options_.series; ++i) series.push_back(series_json(i, moved));
    json events = json::array();
    for (std::size_t i = 0; i < happenings_.size(); ++i) events.push_back(event_json(i, moved[i]));
    const bool has_annotations = options_.eventful && options_.nights >= 20;
    return {{"title", "nightly.sqlite"},
            {"made", utc(kFirst + static_cast<std::int64_t>(options_.nights) * kDay_s + 18000)},
            {"options",
             {{"least_effect", 0.015}, {"least_nights", 4}, {"false_discovery_rate", 0.05}, {"confidence", 0.95}}},
            {"verdict", verdict_json()},
            {"machines", machines_json()},
            {"environments",
             {{{"hash", "4cc2dca1"}, {"text", "Linux 6.1.0-18, Mesa 22.3.6, llvmpipe (LLVM 15.0.6, 256 bits)"}},
              {{"hash", "90d1f3ab"}, {"text", "Linux 6.1.0-18, NVIDIA 545.29, NVIDIA GeForce RTX 3060"}},
              {{"hash", "e52b7c04"}, {"text", "Linux 6.1.0-21, NVIDIA 550.54, NVIDIA GeForce RTX 3060"}}}},
            {"runs", runs_json()},
            {"events", events},
            {"series", series},
            {"annotations", has_annotations ? annotations_json() : json::array()}};
  }

 private:
  [[nodiscard]] std::size_t night_of(const Happening& happening) const {
    return static_cast<std::size_t>(happening.from * static_cast<double>(options_.nights));
  }
  [[nodiscard]] std::size_t run_of(std::size_t machine, std::size_t night) const {
    return night * options_.machines + machine;
  }
  double noise(double sigma) { return std::normal_distribution<double>(0, sigma)(random_); }
  bool happens(double probability) {
    return options_.eventful && std::uniform_real_distribution<double>(0, 1)(random_) < probability;
  }
  /// A new driver came.
  [[nodiscard]] std::size_t epoch_night() const {
    for (const Happening& happening : happenings_)
      if (happening.machine == 1) return night_of(happening);
    return kNone;
  }

  json verdict_json() const {
    const auto nights = fmt::format("{} series on {} machine{}, {} nights", options_.series, options_.machines,
                                    options_.machines == 1 ? "" : "s", options_.nights);
    return happenings_.empty() ? json{{"exit", 0}, {"text", "Nothing moved; " + nights}}
                               : json{{"exit", 1}, {"text", "1 regression, 2 suspects, 1 improvement; " + nights}};
  }

  std::string commit(std::size_t night) const {
    return hex((night + 1) * 0x9e3779b97f4a7c15U, 16) + hex((night + 7) * 0xc2b2ae3d27d4eb4fU, 16);
  }

  json runs_json() const {
    json runs = json::array();
    for (std::size_t night = 0; night < options_.nights; ++night)
      for (std::size_t machine = 0; machine < options_.machines; ++machine)
        runs.push_back({{"time", utc(kFirst + static_cast<std::int64_t>(night) * kDay_s + 10800 +
                                     3600 * static_cast<std::int64_t>(machine))},
                        {"commit", commit(night)},
                        {"parent", night > 0 ? json(commit(night - 1)) : json()},
                        {"dirty", options_.eventful && night == 5},
                        {"machine", machine},
                        {"environment", machine == 0            ? 0
                                        : night < epoch_night() ? 1
                                                                : 2},
                        {"source", fmt::format("out/n{}", night)}});
    return runs;
  }

  json device_json(std::size_t machine, const char* backend) {
    json nights = json::array();
    json control = json::array();
    const std::size_t epoch = machine == 1 ? epoch_night() : kNone;
    for (std::size_t night = 0; night < options_.nights; ++night) {
      nights.push_back(run_of(machine, night));
      const bool is_new = night >= epoch && std::string_view(backend) == "vulkan";
      control.push_back(
          five_digits(2.4e5 * static_cast<double>(machine + 1) * std::exp(noise(0.005) + (is_new ? 0.06 : 0))));
    }
    const bool is_llvmpipe = machine == 0;
    json audit = {{{"timer", "device"},
                   {"valid", !is_llvmpipe},
                   {"wall_ratio", is_llvmpipe ? 1.8 : 0.98},
                   {"doubling", 2.0},
                   {"reason", is_llvmpipe ? "device time is 1.8 times the wall clock's" : ""}},
                  {{"timer", "fenced_wall"}, {"valid", true}, {"wall_ratio", 1.0}, {"doubling", 1.97}, {"reason", ""}}};
    return {{"backend", backend},
            {"name", is_llvmpipe ? "llvmpipe (LLVM 15.0.6, 256 bits)" : "NVIDIA GeForce RTX 3060"},
            {"driver", is_llvmpipe ? "Mesa 22.3.6" : "550.54"},
            {"timer", is_llvmpipe ? "fenced_wall" : "device"},
            {"audit", audit},
            {"filter",
             {{{"texels", "rg8"}, {"bits", 8}, {"rounds", true}},
              {{"texels", "rg16"}, {"bits", 8}, {"rounds", is_llvmpipe}}}},
            {"calibration", {{"nights", nights}, {"control_ns", control}}}};
  }

  json machines_json() {
    json machines = json::array();
    for (std::size_t machine = 0; machine < options_.machines; ++machine)
      machines.push_back(
          {{"name", machine == 0 ? "ci-7" : "lab-gpu"},
           {"nights", options_.nights},
           {"last", options_.nights == 0 ? json() : runs_json()[run_of(machine, options_.nights - 1)]["time"]},
           {"noise", options_.nights < 2 ? json() : json(machine == 0 ? 0.0094 : 0.0061)},
           {"smallest_shift", options_.nights < 2 ? json() : json(machine == 0 ? 0.021 : 0.014)},
           {"devices", {device_json(machine, "vulkan"), device_json(machine, "opengl")}}});
    return machines;
  }

  json series_json(std::size_t index, std::vector<json>& moved) {
    const Traits traits = traits_of(index, options_.machines);
    const std::size_t steps = 16U << (index % 4);
    const std::size_t epoch = traits.machine == 1 ? epoch_night() : kNone;
    json events = json::array();
    json scores = json::array({{0, 0}});
    std::vector<double> shift(options_.nights, 0);
    std::vector<std::size_t> ends;
    json drift;
    for (std::size_t i = 0; i < happenings_.size(); ++i) {
      const Happening& h = happenings_[i];
      if (h.machine != traits.machine || !h.moves(traits)) continue;
      moved[i].push_back(index);
      events.push_back(i + 1);
      if (h.event["kind"] == "errors") scores.push_back({night_of(h), 1});
      if (is_drift(h)) {
        const double per_night = std::log1p(h.share) / static_cast<double>(options_.nights - 1);
        drift = {{"per_night", per_night}, {"low", 0.7 * per_night}, {"high", 1.3 * per_night}};
        for (std::size_t night = 0; night < options_.nights; ++night)
          shift[night] += per_night * static_cast<double>(night);
        continue;
      }
      for (std::size_t night = night_of(h); night < options_.nights; ++night) shift[night] += std::log1p(h.share);
      if (std::abs(h.share) > 0.01) ends.push_back(night_of(h));
    }
    if (epoch != kNone) ends.push_back(epoch);
    ends.push_back(options_.nights);
    std::ranges::sort(ends);
    ends.erase(std::unique(ends.begin(), ends.end()), ends.end());

    const double base = 1e5 * static_cast<double>(steps) * (1 + static_cast<double>(index % 13) / 7) /
                        static_cast<double>(1 + traits.machine * 9);
    json nights = json::array();
    json values = json::array();
    json errors = json::array();
    json invalid = json::array();
    json spikes = json::array();
    json levels = json::array();
    for (std::size_t night = 0, begin = 0, level = 0; night < options_.nights; ++night) {
      nights.push_back(run_of(traits.machine, night));
      const bool is_spike = night > 1 && happens(0.012);
      const bool is_invalid = happens(traits.machine == 0 && night == 12 ? 1 : 0.006);
      if (is_spike) spikes.push_back(night);
      if (is_invalid) invalid.push_back(night);
      errors.push_back(five_digits(0.003 + std::abs(noise(0.001))));
      const double value = five_digits(base * std::exp(shift[night] + noise(kNoise) + (is_spike ? 0.11 : 0)));
      values.push_back(is_invalid && night % 2 == 0 ? json() : json(value));
      if (night + 1 < ends[level]) continue;
      const double half_width = 1.96 * kNoise / std::sqrt(static_cast<double>(night + 1 - begin));
      const double log_value =
          std::log(base) + (shift[night] + (drift.is_null() ? shift[night] : shift[begin])) / 2 + noise(half_width / 4);
      levels.push_back({{"first", begin},
                        {"end", night + 1},
                        {"value", five_digits(std::exp(log_value))},
                        {"low", five_digits(std::exp(log_value - half_width))},
                        {"high", five_digits(std::exp(log_value + half_width))}});
      begin = ends[level++];
    }
    const std::string name = fmt::format("{} {}_steps={}", traits.technique, traits.technique, steps);
    return {{"name", name},
            {"setting", fmt::format("{}@4cc2dca1?steps={}&map={}&format={}&refinement=secant&n={}", traits.technique,
                                    steps, traits.map, traits.format, index)},
            {"scene", traits.scene},
            {"technique", traits.technique},
            {"map", traits.map},
            {"format", traits.format},
            {"backend", traits.backend},
            {"machine", traits.machine},
            {"metric", "frame_time"},
            {"unit", "ns"},
            {"nights", nights},
            {"values", values},
            {"errors", errors},
            {"invalid", invalid},
            {"spikes", spikes},
            {"levels", levels},
            {"sigma", options_.nights < 2 ? json() : json(five_digits(kNoise * std::exp(noise(0.2))))},
            {"smallest_shift", options_.nights < 2 ? json() : json(0.021)},
            {"autocorrelation", options_.nights < 2 ? json() : json(0.08)},
            {"drift", drift},
            {"scores", scores},
            {"events", events}};
  }

  json event_json(std::size_t index, const json& series) const {
    const Happening& h = happenings_[index];
    json event = h.event;
    const std::size_t bad = is_drift(h) ? options_.nights - 1 : night_of(h);
    const std::size_t good = is_drift(h) ? 0 : bad - h.width;
    event["id"] = index + 1;
    event["machine"] = h.machine;
    event["state"] = event["states"].back()["state"];
    event["good_run"] = run_of(h.machine, good);
    event["bad_run"] = run_of(h.machine, bad);
    event["commits"] = {commit(good), commit(bad)};
    const bool is_timed = event["kind"] != "errors";
    const double seen = event["state"] == "cleared" ? 0.019 : h.share;
    event["effect"] = is_timed ? json(seen) : json();
    event["low"] = is_timed ? json(seen - 0.005) : json();
    event["high"] = is_timed ? json(seen + 0.005) : json();
    event["series"] = series;
    if (!event.contains("text")) event["text"] = "";
    std::int64_t night = std::min(static_cast<std::int64_t>(bad) + 3, static_cast<std::int64_t>(options_.nights) - 2);
    for (json& state : event["states"]) state["time"] = utc(kFirst + kDay_s * night++ + 18000);
    return event;
  }

  json annotations_json() const {
    return {{{"run", run_of(0, 7)},
             {"event", nullptr},
             {"time", utc(kFirst + 7 * kDay_s + 40000)},
             {"by", "ann"},
             {"text", "new power supply"}},
            {{"run", nullptr},
             {"event", 1},
             {"time", utc(kFirst + 33 * kDay_s)},
             {"by", "bo"},
             {"text", "the secant loop lost its unrolling; fix is under review"}}};
  }

  MadeTrendOptions options_;
  std::mt19937 random_;
  std::vector<Happening> happenings_;
};

}  // namespace

json made_trend(const MadeTrendOptions& options) { return TrendMaker(options).make(); }

}  // namespace reliefbench
