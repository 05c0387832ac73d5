#pragma once
#include <cstddef>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>

namespace reliefbench {

struct MadeTrendOptions {
  std::size_t series = 378;
  std::size_t nights = 40;  ///< of each machine
  std::size_t machines = 2;
  bool eventful = true;  ///< with events, invalid nights and what people said; else every night is like the last
  std::uint32_t seed = 1;
};

/// The data of a trend page, made up but shaped like real ones: a confirmed regression of a technique, an improvement,
/// a suspect, an event cleared and one accepted, changed errors, a new driver with its epoch, spikes, nights that were
/// not looked at, annotations. The same options give the same data.
[[nodiscard]] nlohmann::json made_trend(const MadeTrendOptions& options = {});

}  // namespace reliefbench
