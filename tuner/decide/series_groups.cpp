#include "tuner/decide/series_groups.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

namespace reliefbench {
namespace {

constexpr int kPoolRounds = 50;        // of backfitting; tracks that share their nights need one
constexpr double kPoolRest = 1e-7;     // of a log: what a round may still move
constexpr std::size_t kPoolShare = 3;  // a night has one of so many tracks, at least

/// What a series has besides its backend, as text: "technique=cone".
std::vector<std::string> trait_texts(const SeriesTraits& traits) {
  std::vector<std::string> texts;
  const std::array<std::pair<const char*, const std::string*>, 4> named{{{"technique=", &traits.technique},
                                                                         {"map=", &traits.map},
                                                                         {"format=", &traits.format},
                                                                         {"scene=", &traits.scene}}};
  for (const auto& [name, value] : named)
    if (!value->empty()) texts.push_back(name + *value);
  return texts;
}

/// Sorts groups of fewer traits first, and of as many those of a technique before those of a map.
struct GroupKey {
  std::string machine;
  std::size_t traits = 0;
  std::size_t place = 0;  ///< of the traits among all
  std::string what;
  [[nodiscard]] bool operator<(const GroupKey& other) const {
    return std::tie(traits, place, machine, what) < std::tie(other.traits, other.place, other.machine, other.what);
  }
};

/// Of all groups that a series is in.
std::vector<GroupKey> group_keys(const SeriesTraits& traits) {
  const std::vector<std::string> texts = trait_texts(traits);
  std::vector<GroupKey> keys;
  const auto add = [&](std::size_t count, const std::string& what) {
    const std::size_t place = keys.size();
    keys.push_back({traits.machine, count, place, what.empty() ? "everything" : what});
    if (!traits.backend.empty())
      keys.push_back({traits.machine, count + 1, place, what.empty() ? traits.backend : traits.backend + ' ' + what});
  };
  add(0, "");
  for (std::size_t i = 0; i < texts.size(); ++i) {
    add(1, texts[i]);
    for (std::size_t j = i + 1; j < texts.size(); ++j) add(2, texts[i] + ' ' + texts[j]);
  }
  return keys;
}

/// Sums by night.
struct NightSums {
  explicit NightSums(std::size_t nights) : sums(nights), weights(nights), squares(nights), tracks(nights) {}
  std::vector<double> sums;
  std::vector<double> weights;
  std::vector<double> squares;  // of weighted standard errors
  std::vector<std::size_t> tracks;
  [[nodiscard]] double mean(std::size_t night) const { return weights[night] > 0 ? sums[night] / weights[night] : 0; }
};

}  // namespace

std::vector<SeriesGroup> series_groups(std::span<const CheckedSeries> series) {
  std::map<GroupKey, std::vector<std::size_t>> by_key;
  for (std::size_t i = 0; i < series.size(); ++i) {
    if (series[i].traits.is_control) continue;
    for (GroupKey& key : group_keys(series[i].traits)) by_key[std::move(key)].push_back(i);
  }
  std::vector<SeriesGroup> groups;
  std::set<std::vector<std::size_t>> seen;
  for (const auto& [key, members] : by_key)
    if (members.size() > 1 && seen.insert(members).second) groups.push_back({.what = key.what, .members = members});
  return groups;
}

Track pooled(std::span<const WeightedTrack> tracks) {
  std::size_t nights = 0;
  for (const auto& [track, weight] : tracks)
    if (!track->calendar.empty()) nights = std::max(nights, track->calendar.back() + 1);
  NightSums pool(nights);
  std::vector<double> offsets;
  for (const auto& [track, weight] : tracks) {
    double sum = 0;
    for (std::size_t i = 0; i < track->logs.size(); ++i) {
      const std::size_t night = track->calendar[i];
      pool.weights[night] += weight;
      pool.squares[night] += weight * weight * track->errors[i] * track->errors[i];
      ++pool.tracks[night];
      sum += track->logs[i];
    }
    offsets.push_back(sum / std::max(1.0, static_cast<double>(track->logs.size())));
  }
  double moved = 1;
  for (int round = 0; round < kPoolRounds && moved > kPoolRest; ++round) {
    std::ranges::fill(pool.sums, 0);
    for (std::size_t t = 0; t < tracks.size(); ++t)
      for (std::size_t i = 0; i < tracks[t].track->logs.size(); ++i)
        pool.sums[tracks[t].track->calendar[i]] += tracks[t].weight * (tracks[t].track->logs[i] - offsets[t]);
    moved = 0;
    for (std::size_t t = 0; t < tracks.size(); ++t) {
      const Track& track = *tracks[t].track;
      double rest = 0;
      for (std::size_t i = 0; i < track.logs.size(); ++i)
        rest += track.logs[i] - offsets[t] - pool.mean(track.calendar[i]);
      rest /= std::max(1.0, static_cast<double>(track.logs.size()));
      offsets[t] += rest;
      moved = std::max(moved, std::abs(rest));
    }
  }
  Track result;
  for (std::size_t night = 0; night < nights; ++night) {
    if (pool.tracks[night] == 0 || kPoolShare * pool.tracks[night] < tracks.size()) continue;
    result.calendar.push_back(night);
    result.logs.push_back(pool.mean(night));
    result.errors.push_back(std::sqrt(pool.squares[night]) / pool.weights[night]);
  }
  return result;
}

}  // namespace reliefbench
