#include "tuner/results/csv.h"

#include "kernels/base/append_file.h"
#include "kernels/base/error.h"

namespace reliefbench {
namespace {

std::string quoted(const std::string& cell) {
  if (cell.find_first_of(",\"\r\n") == std::string::npos) return cell;
  std::string out = "\"";
  for (const char c : cell) {
    if (c == '"') out += '"';
    out += c;
  }
  return out + '"';
}

/// Reads one cell after the other.
class CsvReader {
 public:
  CsvReader(std::string_view text, std::string_view file) : text_(text), file_(file) {
    if (text_.starts_with("\xEF\xBB\xBF")) at_ = 3;
  }

  [[nodiscard]] bool is_done() const { return at_ >= text_.size(); }

  CsvRow row() {
    CsvRow row{.line = line_, .cells = {}};
    row_at_ = at_;
    do row.cells.push_back(cell());
    while (take(','));
    if (take('\r')) {
      if (!is_done() && text_[at_] != '\n') fail_input("{}:{}: a carriage return within a cell", file_, line_);
    }
    if (take('\n')) ++line_;
    return row;
  }

 private:
  bool take(char c) {
    if (is_done() || text_[at_] != c) return false;
    ++at_;
    return true;
  }

  void check_length(int line) const {
    if (at_ - row_at_ > kMostLineBytes)
      fail_input("{}:{}: a row of over {} bytes, expected one case", file_, line, kMostLineBytes);
  }

  std::string cell() {
    if (take('"')) return quoted_cell();
    const std::size_t end = std::min(text_.find_first_of(",\r\n", at_), text_.size());
    const std::string_view plain = text_.substr(at_, end - at_);
    if (plain.find('"') != std::string_view::npos) fail_input("{}:{}: a quote within a cell", file_, line_);
    at_ = end;
    check_length(line_);
    return std::string(plain);
  }

  std::string quoted_cell() {
    const int begin = line_;
    std::string out;
    for (;;) {
      if (is_done()) fail_input("{}:{}: a quoted cell has no end", file_, begin);
      check_length(begin);
      const char c = text_[at_++];
      if (c == '\n') ++line_;
      if (c != '"') {
        out += c;
      } else if (take('"')) {
        out += '"';
      } else {
        if (!is_done() && std::string_view(",\r\n").find(text_[at_]) == std::string_view::npos)
          fail_input("{}:{}: text after a closing quote", file_, line_);
        return out;
      }
    }
  }

  std::string_view text_;
  std::string_view file_;
  std::size_t at_ = 0;
  std::size_t row_at_ = 0;  ///< where the row begins
  int line_ = 1;
};

}  // namespace

std::string csv_line(std::span<const std::string> cells) {
  std::string line;
  for (const std::string& cell : cells) {
    if (&cell != cells.data()) line += ',';
    line += quoted(cell);
  }
  return line + "\r\n";
}

std::vector<CsvRow> parse_csv(std::string_view text, std::string_view file) {
  std::vector<CsvRow> rows;
  for (CsvReader reader(text, file); !reader.is_done();) {
    rows.push_back(reader.row());
    if (rows.back().cells.size() != rows.front().cells.size())
      fail_input("{}:{}: has {} cells, the first line {}", file, rows.back().line, rows.back().cells.size(),
                 rows.front().cells.size());
  }
  return rows;
}

}  // namespace reliefbench
