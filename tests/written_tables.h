#pragma once
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "tuner/results/case_table.h"
#include "tuner/results/t4.h"

namespace reliefbench {

/// What write_case_table() and write_t4() write.
inline std::string case_table_csv(std::span<const TableRow> rows) {
  std::ostringstream out;
  write_case_table(rows, out);
  return out.str();
}
inline nlohmann::json t4_json(const Run& run, std::span<const TableRow> rows, std::span<const Budget> constraints) {
  std::ostringstream out;
  write_t4(run, rows, constraints, out);
  return nlohmann::json::parse(out.str());
}

}  // namespace reliefbench
