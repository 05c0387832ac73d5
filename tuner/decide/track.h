#pragma once
#include <cstddef>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/base/error.h"
#include "tuner/decide/events.h"
#include "tuner/history/rows.h"

namespace reliefbench {

/// A series in one epoch: the nights that were looked at together.
struct EpochChanges {
  std::size_t series = 0;           ///< index in HistoryView::series
  std::vector<std::size_t> nights;  ///< indices in HistoryView::nights[series], the valid ones
  SeriesChanges changes;            ///< its indices are of `nights`
};

/// Which series a check could compare.
struct Coverage {
  std::size_t looked_at = 0;       ///< series, without those that are gone
  std::size_t gone = 0;            ///< series that had values and have none in the last nights
  std::int64_t gone_unix_s = 0;    ///< the last night of that one of them that is gone longest
  std::size_t waiting = 0;         ///< of those looked at: too few nights in their present epoch; 0 in a young history
  std::size_t nights_to_wait = 0;  ///< more that the series with most needs until any step in time can show
};

/// What a check of a history comes to.
struct TrackCheck {
  std::vector<EventRow> events;  ///< all that are known: worst first within each state, open ones first
  std::vector<bool> is_news;     ///< parallel: whether this check gave it its last state
  std::vector<EpochChanges> epochs;
  double case_shift = 0;  ///< median over the series of the last epochs: what would be told within 5 nights in 9 of 10
  Coverage coverage;
};

/// Looks for changes in every series of every epoch, and gives each event its state: suspect when it is new; confirmed
/// when enough further nights have it; cleared when they take it back (absence.h); environment when shaders, driver and
/// stages are the same on both sides while the control case moved along, or when a re-run of both builds did not show
/// it; recovered when a later change undid it. What a person accepted stays accepted. An accepted drift keeps its size,
/// and is open again where its interval exceeds that by the least effect.
///
/// An event is one that is known where the keys are equal, else where machine and direction agree, the nights overlap
/// and most of the series do. The nights of errors and of lost cases are certain, those of steps within two.
///
/// Errors are deterministic: any other value is an event, unless what is drawn (RepetitionRow::code) changed as well;
/// such a one is accepted from the start. Errors that were there since the last accepted change and come back are no
/// event; those that led away from them are recovered.
[[nodiscard]] TrackCheck check_history(const HistoryView& view, const EventOptions& options, std::int64_t now_unix_s);

/// Whether somebody has to act on it: a regression, suspect or confirmed.
[[nodiscard]] bool is_open(const EventRow& event);

/// 5: no night; 1: an open regression, with `news_only` one that this check found; 0
[[nodiscard]] Exit exit_of(const TrackCheck& check, const HistoryView& view, bool news_only);

/// The events that are to be stored: those with news.
[[nodiscard]] std::vector<EventRow> news_of(const TrackCheck& check);

}  // namespace reliefbench
