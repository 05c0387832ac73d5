#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "tuner/decide/changes.h"

namespace reliefbench {

/// What a series has in common with others: {"backend", "vulkan"}, {"technique", "cone"}, {"map", ...}, {"format",
/// ...}.
struct SeriesTraits {
  std::string machine;
  std::string backend;
  std::string technique;
  std::string map;
  std::string format;
  std::string scene;
  bool is_control = false;  ///< the control case, raw: stands for the whole device
};

/// A series as it is checked: its nights as indices of one common calendar (runs of all machines by time).
struct CheckedSeries {
  SeriesTraits traits;
  std::vector<std::size_t> calendar;  ///< rising
  std::vector<double> log_values;     ///< parallel
  std::vector<double> standard_errors;
};

/// Series of one machine that moved together.
struct ChangeEvent {
  std::string what;  ///< the group that holds them: "vulkan technique=relaxed_cone"; all: "everything"; a case by
                     ///< itself is empty
  std::vector<std::size_t> series;  ///< indices
  std::size_t good = 0;             ///< calendar: last night of the old level for certain
  std::size_t bad = 0;              ///< calendar: first night of the new level for certain
  bool is_drift = false;
  double log_ratio = 0;  ///< pooled
  double low = 0;
  double high = 0;
  double q = 1;          ///< Benjamini-Hochberg over all series and groups looked at
  bool is_sure = false;  ///< enough nights beyond the least to be confirmed without a re-run
};

struct EventOptions {
  ChangeOptions change;
  double false_discovery_rate = 0.01;  ///< of one look; a look every night is many
  std::size_t confirming_nights = 3;   ///< nights beyond the least that confirm a step
};

struct Findings {
  std::vector<SeriesChanges> series;  ///< parallel to the input
  std::vector<ChangeEvent> events;    ///< worst first: slower before faster, sure before unsure, then by size
};

/// Looks for steps and drifts in every series and in what they share (the mean log over a technique, map, format,
/// scene, backend and machine, where smaller steps show), and joins what is one change.
[[nodiscard]] Findings find_events(std::span<const CheckedSeries> series, const EventOptions& options);

}  // namespace reliefbench
