#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "tuner/decide/track.h"
#include "tuner/history/rows.h"

namespace reliefbench {

/// What the trend page shows of a history. title: the database's name, without what is secret in it
[[nodiscard]] nlohmann::json trend_data_json(const HistoryView& view, const TrackCheck& check,
                                             const EventOptions& options, const std::string& title);

}  // namespace reliefbench
