#pragma once
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace reliefbench {

/// One row of a CSV file.
struct CsvRow {
  int line = 1;  ///< of the file, from 1, where the row begins
  std::vector<std::string> cells;
};

/// The cells as one line that ends in CRLF (RFC 4180): quoted where they hold a comma, a quote or a line break.
[[nodiscard]] std::string csv_line(std::span<const std::string> cells);

/// Reads RFC 4180; lines may end in LF alone, a byte order mark is skipped.
/// file: for messages only
/// throws: Error(bad_input) "FILE:LINE: ...": an open quote, text after a closing one, a row with more or fewer cells
///         than the first, or of over kMostLineBytes
[[nodiscard]] std::vector<CsvRow> parse_csv(std::string_view text, std::string_view file);

}  // namespace reliefbench
