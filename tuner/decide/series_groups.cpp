#include "tuner/decide/series_groups.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <numeric>
#include <set>
#include <tuple>

namespace reliefbench {
namespace {

constexpr int kPoolRounds = 50;     // of backfitting; tracks that share their nights need one
constexpr double kPoolRest = 1e-7;  // of a log: what a round may still move
constexpr double kPoolShare = 3;    // a night has one of so many tracks, at least

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

/// Calls of_run(first, night, count) for every run of a track's nights that follow one another.
template <typename OfRun>
void for_each_run(const Track& track, const OfRun& of_run) {
  const std::vector<std::size_t>& calendar = track.calendar;
  for (std::size_t first = 0; first < calendar.size();) {
    const auto follows = [&](const std::size_t& night) {
      return night - calendar[first] == static_cast<std::size_t>(&night - calendar.data()) - first;
    };
    const auto end =
        std::partition_point(calendar.begin() + static_cast<std::ptrdiff_t>(first), calendar.end(), follows);
    const auto count = static_cast<std::size_t>(end - calendar.begin()) - first;
    of_run(first, calendar[first], count);
    first += count;
  }
}

/// One value a night, of which all that follow one another are changed at once.
class NightSums {
 public:
  explicit NightSums(std::size_t nights) : steps_(nights + 1) {}
  void add(std::size_t night, std::size_t count, double value) {
    steps_[night] += value;
    steps_[night + count] -= value;
  }
  [[nodiscard]] std::vector<double> values() const {
    std::vector<double> values(steps_.size() - 1);
    std::partial_sum(steps_.begin(), steps_.end() - 1, values.begin());
    return values;
  }

 private:
  std::vector<double> steps_;  // from the night before
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
  std::vector<double> logs(nights);     // weighted sums
  std::vector<double> squares(nights);  // of weighted standard errors
  NightSums weight_sums(nights);
  NightSums track_counts(nights);
  std::vector<double> means;  // of tracks
  for (const auto& [track, weight] : tracks) {
    for_each_run(*track,
                 [&, &track = track, &weight = weight](std::size_t first, std::size_t night, std::size_t count) {
                   for (std::size_t i = 0; i < count; ++i) logs[night + i] += weight * track->logs[first + i];
                   for (std::size_t i = 0; i < count; ++i) {
                     const double error = weight * track->errors[first + i];
                     squares[night + i] += error * error;
                   }
                   weight_sums.add(night, count, weight);
                   track_counts.add(night, count, 1);
                 });
    means.push_back(std::accumulate(track->logs.begin(), track->logs.end(), 0.0) /
                    std::max(1.0, static_cast<double>(track->logs.size())));
  }
  const std::vector<double> weights = weight_sums.values();
  const std::vector<double> counts = track_counts.values();

  std::vector<double> offsets = means;
  std::vector<double> common(nights);
  double moved = 1;
  for (int round = 0; round < kPoolRounds && moved > kPoolRest; ++round) {
    NightSums offset_sums(nights);
    for (std::size_t t = 0; t < tracks.size(); ++t)
      for_each_run(*tracks[t].track, [&](std::size_t, std::size_t night, std::size_t count) {
        offset_sums.add(night, count, tracks[t].weight * offsets[t]);
      });
    const std::vector<double> of_offsets = offset_sums.values();
    std::vector<double> before(nights + 1);  // of a night: what all before it have in common, summed
    for (std::size_t night = 0; night < nights; ++night) {
      common[night] = counts[night] > 0 ? (logs[night] - of_offsets[night]) / weights[night] : 0;
      before[night + 1] = before[night] + common[night];
    }
    moved = 0;
    for (std::size_t t = 0; t < tracks.size(); ++t) {
      double shared = 0;
      for_each_run(*tracks[t].track, [&](std::size_t, std::size_t night, std::size_t count) {
        shared += before[night + count] - before[night];
      });
      const double offset = means[t] - shared / std::max(1.0, static_cast<double>(tracks[t].track->logs.size()));
      moved = std::max(moved, std::abs(offset - offsets[t]));
      offsets[t] = offset;
    }
  }
  Track result;
  for (std::size_t night = 0; night < nights; ++night) {
    if (counts[night] == 0 || kPoolShare * counts[night] < static_cast<double>(tracks.size())) continue;
    result.calendar.push_back(night);
    result.logs.push_back(common[night]);
    result.errors.push_back(std::sqrt(squares[night]) / weights[night]);
  }
  return result;
}

}  // namespace reliefbench
