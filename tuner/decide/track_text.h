#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "tuner/decide/track.h"
#include "tuner/history/rows.h"

namespace reliefbench {

/// "5.2 % slower [4.7, 5.7]"; of errors and lost cases their words.
[[nodiscard]] std::string effect_text(const EventRow& event);

/// Where a step lies: "between the nights of 2026-11-24 (abc1234) and 2026-11-25 (def5678) on ci-7".
[[nodiscard]] std::string interval_text(const EventRow& event, const HistoryView& view);

/// "1 regression, 1 suspect; 378 series on 1 machine, 40 nights". Where nothing is open: what would have been found.
[[nodiscard]] std::string verdict_text(const HistoryView& view, const TrackCheck& check);

/// "Linux 6.1, vulkan llvmpipe (Mesa 22.3.6)"
[[nodiscard]] std::string environment_text(const EnvironmentRow& row);

/// The check for machines (configs/schema/track_check.schema.json).
[[nodiscard]] nlohmann::json track_json(const HistoryView& view, const TrackCheck& check);

/// The open events, and those that are new, as a comment or mail. Nothing to say: one line.
[[nodiscard]] std::string track_markdown(const HistoryView& view, const TrackCheck& check);

/// JUnit XML: an event is a test case, an open one a failure; one case passes where nothing is open.
[[nodiscard]] std::string track_junit(const HistoryView& view, const TrackCheck& check);

}  // namespace reliefbench
