#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tuner/config.h"
#include "tuner/record.h"

namespace reliefbench {

struct Question {
  std::vector<Budget> budgets;            ///< all must hold
  std::optional<double> max_time_ms{};    ///< then: the most accurate within it; else: the fastest within the budgets
  std::string error_metric = "e_xy.p99";  ///< what "most accurate" means
};

/// The answer for one device and scene. Pointers go into the records that were asked.
struct Answer {
  std::string backend;
  std::string device;
  std::string scene;
  const Record* pick = nullptr;       ///< null: nothing meets the question
  const Record* runner_up = nullptr;  ///< next best of another settings
  const Record* simplest = nullptr;   ///< simplest technique (registry order: flat, parallax, ...) that meets it
  const Record* flat = nullptr;       ///< the floor of frame time
  const Record* nearest = nullptr;    ///< where pick is null: the one that comes nearest
  std::string miss;                   ///< how near it came, in words: "e_xy.p99 is 0.61 where 0.5 is asked"
};

/// One answer a (backend, device, scene), judged by the upper end of the time interval, never by the luckiest median.
[[nodiscard]] std::vector<Answer> recommend(std::span<const Record> records, const Question& question);

}  // namespace reliefbench
