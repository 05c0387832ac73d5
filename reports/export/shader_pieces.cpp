#include "reports/export/shader_pieces.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>

#include "kernels/base/embedded.h"
#include "kernels/base/error.h"
#include "reports/export/glsl_fold.h"
#include "reports/export/ray_text.h"

namespace reliefbench {

bool is_word_character(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

std::vector<std::string> words_of(std::string_view text) {
  std::vector<std::string> words;
  for (const std::string& line : text_lines(text)) {
    std::string word;
    for (const char c : std::string(code_of(line)) + " ") {
      if (is_word_character(c)) {
        word += c;
      } else if (!word.empty()) {
        words.push_back(std::move(word));
        word.clear();
      }
    }
  }
  return words;
}

namespace {

/// Code without the `layout(...)` that it may begin with.
std::string_view without_layout(std::string_view code) {
  const std::size_t close = code.starts_with("layout(") ? closing(code, code.find('(')) : std::string_view::npos;
  return close == std::string_view::npos ? code : code.substr(close + 1);
}

/// A line that only says something of the declaration in the next one: attributes, a template's parameters.
bool is_before_declaration(std::string_view code) {
  return code.starts_with('@') || code.starts_with("template<") ||
         (code.starts_with("static inline __attribute__") && code.ends_with("))"));
}

/// throws: Error(environment): a line has no such word
std::string word_at(const std::vector<std::string>& words, std::size_t at, std::string_view line) {
  if (at >= words.size()) fail_environment("shader text: \"{}\" declares nothing", line);
  return words[at];
}

/// Says what a piece declares: the macros of preprocessor lines; else the last word before the first of `( = ; { :`.
void name(Piece& piece) {
  for (const std::string& line : text_lines(piece.text)) {
    const std::string_view code = code_of(line);
    if (code.starts_with("#define ")) piece.names.push_back(word_at(words_of(code), 1, code));
    if (code.empty() || code.front() == '#' || is_before_declaration(code)) continue;
    if (!piece.names.empty()) return;
    const std::string_view declaration = without_layout(code);
    const std::size_t end = std::min(declaration.find_first_of("(=;{:"), declaration.size());
    const std::vector<std::string> words = words_of(declaration.substr(0, end));
    piece.names = {word_at(words, words.size() - 1, code)};
    piece.is_function = end < declaration.size() && declaration[end] == '(';
    return;
  }
}

/// Cuts lines into pieces.
class Cutter {
 public:
  Cutter(std::string file, Pieces& pieces) : file_(std::move(file)), pieces_(pieces) {}

  void add(const std::string& line) {
    const std::string_view code = code_of(line);
    const bool is_open = braces_ > 0 || conditions_ > 0;
    if (line.empty() && !is_open) {
      end();
      after_blank_ = true;
      return;
    }
    text_ += line + "\n";
    conditions_ += code.starts_with("#if") ? 1 : (code.starts_with("#endif") ? -1 : 0);
    braces_ += static_cast<int>(std::ranges::count(code, '{') - std::ranges::count(code, '}'));
    const bool is_whole = code.starts_with("#") || code.ends_with(';') || code.ends_with('}');
    if (is_whole && braces_ == 0 && conditions_ == 0) end();
  }
  void end() {
    if (text_.empty()) return;
    pieces_.push_back({.file = file_, .text = text_, .after_blank = after_blank_});
    name(pieces_.back());
    text_.clear();
    after_blank_ = false;
  }

 private:
  std::string file_;
  Pieces& pieces_;
  std::string text_;
  bool after_blank_ = true;
  int braces_ = 0;
  int conditions_ = 0;
};

/// Files as they come to be pieces, each once.
class PieceReader {
 public:
  PieceReader(const GlslCut& cut, Pieces& pieces) : cut_(cut), rays_(cut.defines), pieces_(pieces) {}

  /// The pieces of a file, those of the includes at its head first.
  void read(const std::string& file) {
    if (!seen_.insert(file).second) return;
    if (file == "ray.glsl") return;  // its macros are written out
    const auto found = cut_.generated.find(file);
    std::vector<std::string> lines = rays_.written_out(
        text_lines(found != cut_.generated.end() ? found->second : embedded_text(embedded_shaders(), file)));
    if (lines.size() > 2 && lines.front().starts_with("#ifndef ")) {  // the guard
      lines.erase(lines.begin(), lines.begin() + 2);
      lines.pop_back();
    }
    const auto body = std::ranges::find_if(
        lines, [](const std::string& line) { return !code_of(line).empty() && !line.starts_with('#'); });
    for (auto line = lines.begin(); line != body; ++line) include(*line);
    Cutter cutter(file, pieces_);
    for (auto line = lines.begin(); line != lines.end(); ++line) {
      if (!line->starts_with(kInclude)) {
        cutter.add(*line);
      } else if (line > body) {
        cutter.end();
        include(*line);
      }
    }
    cutter.end();
  }

 private:
  static constexpr std::string_view kInclude = "#include \"";
  void include(const std::string& line) {
    if (line.starts_with(kInclude)) read(line.substr(kInclude.size(), line.rfind('"') - kInclude.size()));
  }

  const GlslCut& cut_;
  RayText rays_;
  Pieces& pieces_;
  std::set<std::string> seen_;
};

/// "const int NAME = VALUE;" as words: const int NAME VALUE; none: another declaration
std::vector<std::string> constant_words(const Piece& piece) {
  std::vector<std::string> words = words_of(without_layout(code_of(text_lines(piece.text).back())));
  if (words.size() != 4 || words[0] != "const" || words[1] != "int") words.clear();
  return words;
}

int number(const std::string& text) {
  int value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

/// The named choice that stands for a value of a constant: WRAP_CLAMP for 1 of WRAP; else the number.
std::string value_text(const GlslConstants& choices, const std::string& constant, int value) {
  const std::string family = constant + "_";
  for (const auto& [name, known] : choices)
    if (name.starts_with(family) && known == value) return name;
  return fmt::format("{}", value);
}

/// `layout(constant_id = 3) const int LOOP = LOOP_EARLY_EXIT;` to `const int LOOP = <its value>;`
/// returns: the value of every integer constant
GlslConstants specialise(Pieces& pieces, const std::map<int, int>& given) {
  constexpr std::string_view kSpecialised = "layout(constant_id = ";
  GlslConstants choices;
  for (const Piece& piece : pieces)
    if (const auto words = constant_words(piece); !words.empty() && !piece.text.starts_with("layout"))
      choices.emplace(words[2], number(words[3]));
  GlslConstants constants = choices;
  for (Piece& piece : pieces) {
    if (!piece.text.starts_with(kSpecialised)) continue;
    const std::vector<std::string> words = constant_words(piece);
    const std::string named = word_at(words, 3, piece.text);
    const auto choice = choices.find(named);
    const int fallback = choice == choices.end() ? number(named) : choice->second;
    const auto found = given.find(number(word_at(words_of(piece.text), 2, piece.text)));
    const int value = found == given.end() ? fallback : found->second;
    piece.text = fmt::format("const int {} = {};\n", words[2], value_text(choices, words[2], value));
    constants.emplace(words[2], value);
  }
  return constants;
}

void mark(Pieces& pieces, const std::string& name) {
  for (Piece& piece : pieces) {
    if (piece.is_needed || std::ranges::find(piece.names, name) == piece.names.end()) continue;
    piece.is_needed = true;
    for (const std::string& word : words_of(piece.text)) mark(pieces, word);
  }
}

}  // namespace

Pieces pieces_of(std::string_view text, const std::string& file) {
  Pieces pieces;
  Cutter cutter(file, pieces);
  for (const std::string& line : text_lines(text)) cutter.add(line);
  cutter.end();
  return pieces;
}

void keep_needed(Pieces& pieces, const std::set<std::string>& roots) {
  for (Piece& piece : pieces) piece.is_needed = false;
  for (const std::string& root : roots) mark(pieces, root);
  std::set<std::string> files;
  for (const Piece& piece : pieces)
    if (piece.is_needed) files.insert(piece.file);
  for (Piece& piece : pieces)
    if (piece.names.empty() && files.contains(piece.file)) piece.is_needed = true;
}

std::string text_of(const Pieces& pieces) {
  std::string text;
  bool after_blank = false;
  for (const Piece& piece : pieces) {
    after_blank = after_blank || piece.after_blank;
    if (!piece.is_needed) continue;
    if (after_blank && !text.empty()) text += "\n";
    text += piece.text;
    after_blank = false;
  }
  return text;
}

Pieces cut_glsl(const GlslCut& cut) {
  Pieces pieces;
  PieceReader reader(cut, pieces);
  for (const std::string& file : cut.files) reader.read(file);
  const GlslConstants constants = specialise(pieces, cut.constants);
  for (Piece& piece : pieces) piece.text = folded(piece.text, constants);
  keep_needed(pieces, cut.roots);
  return pieces;
}

}  // namespace reliefbench
