#include "reports/export/shader_rewrite.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <functional>
#include <iterator>
#include <map>
#include <set>
#include <string_view>
#include <vector>

#include "kernels/trace/shader_contract.h"
#include "reports/export/glsl_fold.h"

namespace reliefbench {
namespace {

constexpr std::size_t kLineEnd = 120;

/// A word of the code, and what stands round it.
struct Word {
  std::string_view text;
  std::string_view before;  ///< of its line
  std::string_view after;
  [[nodiscard]] bool is_member() const { return before.ends_with('.'); }
  [[nodiscard]] bool is_called() const { return after.starts_with('('); }
};
/// What stands instead of the word and of `taken` characters after it.
struct Replacement {
  std::string text;
  std::size_t taken = 0;
};
using Rewrite = std::function<Replacement(const Word&)>;

/// Text with each word of its code replaced; comments and preprocessor lines stay.
std::string rewritten(std::string_view text, const Rewrite& rewrite) {
  std::string out;
  for (const std::string& line : text_lines(text)) {
    const std::string_view code = line.starts_with('#') ? "" : code_of(line);
    std::size_t at = 0;
    while (at < code.size()) {
      std::size_t end = at;
      while (end < code.size() && is_word_character(code[end])) ++end;
      if (end == at) {
        out += code[at++];
        continue;
      }
      const Replacement replacement =
          rewrite({.text = code.substr(at, end - at), .before = code.substr(0, at), .after = code.substr(end)});
      out += replacement.text;
      at = end + replacement.taken;
    }
    out += std::string_view(line).substr(code.size());
    out += "\n";
  }
  return out;
}

Replacement same(const Word& word) { return {std::string(word.text)}; }

/// `textureLod(map, ` as `textureLod(sampler2D(map, relief_sampler), `, and maps as textures.
Replacement apart(const Word& word) {
  if (word.text == "sampler2D") return {"texture2D"};
  if (!word.is_called() || (word.text != "textureLod" && word.text != "textureGather")) return same(word);
  const std::size_t comma = word.after.find(',');
  return {fmt::format("{}(sampler2D({}, {})", word.text, word.after.substr(1, comma - 1), kReliefSampler), comma};
}

/// What functions get, in the order of their parameters.
struct Resource {
  std::string_view name;
  std::string_view type;
};

std::vector<Resource> resources_of(MapArguments arguments) {
  const bool is_separate = arguments == MapArguments::separate;
  const std::string_view type = is_separate ? "texture2D" : "sampler2D";
  std::vector<Resource> resources = {{kReliefMap, type}, {kExtraMap, type}};
  if (is_separate) resources.push_back({kReliefSampler, "sampler"});
  resources.push_back({kDitherPhase, "const float"});
  return resources;
}

/// Which resources each function needs, by its name.
std::map<std::string, std::set<std::string>, std::less<>> needs_of(const Pieces& pieces,
                                                                   const std::vector<Resource>& resources) {
  std::map<std::string, std::set<std::string>, std::less<>> needs;
  for (bool has_grown = true; has_grown;) {
    has_grown = false;
    for (const Piece& piece : pieces) {
      if (!piece.is_needed || !piece.is_function) continue;
      std::set<std::string>& own = needs[piece.names.front()];
      const std::size_t before = own.size();
      for (const std::string& word : words_of(piece.text)) {
        if (std::ranges::find(resources, word, &Resource::name) != resources.end()) own.insert(word);
        if (const auto found = needs.find(word); found != needs.end() && &found->second != &own)
          own.insert(found->second.begin(), found->second.end());
      }
      has_grown = has_grown || own.size() > before;
    }
  }
  return needs;
}

/// The numbers of digits and names apart, is a name all capitals?
bool is_constant(std::string_view name) {
  return std::ranges::none_of(name, [](unsigned char c) { return std::islower(c) != 0; }) &&
         std::ranges::any_of(name, [](unsigned char c) { return std::isupper(c) != 0; });
}

}  // namespace

void pass_maps(Pieces& pieces, MapArguments arguments) {
  const std::vector<Resource> resources = resources_of(arguments);
  std::erase_if(pieces, [&](const Piece& piece) {  // their declarations
    return !piece.is_function && !piece.names.empty() &&
           std::ranges::find(resources, piece.names.front(), &Resource::name) != resources.end();
  });
  for (Piece& piece : pieces) {
    if (arguments == MapArguments::separate) piece.text = rewritten(piece.text, apart);
  }
  const auto needs = needs_of(pieces, resources);
  for (Piece& piece : pieces) {
    if (!piece.is_function) continue;
    bool is_declared = false;  // the first time that a function's name stands in its piece
    piece.text = rewritten(piece.text, [&](const Word& word) {
      const auto found = needs.find(word.text);
      if (!word.is_called() || word.is_member() || found == needs.end()) return same(word);
      const bool is_declaration = !is_declared && word.text == piece.names.front();
      is_declared = is_declared || is_declaration;
      std::string list;
      for (const Resource& one : resources)
        if (found->second.contains(std::string(one.name)))
          list += fmt::format("{}{}{}{}", list.empty() ? "" : ", ", is_declaration ? one.type : "",
                              is_declaration ? " " : "", one.name);
      if (!list.empty() && !word.after.starts_with("()")) list += ", ";
      return Replacement{fmt::format("{}({}", word.text, list), 1};
    });
  }
}

std::string prefixed_name(const std::string& name) {
  for (const std::string_view prefix : {"relief_", "Relief", "RELIEF_"})
    if (name.starts_with(prefix)) return name;
  if (name == "trace") return "relief_first_hit";  // relief_trace is what whole pixels are traced with
  if (is_constant(name)) return "RELIEF_" + name;
  if (std::isupper(static_cast<unsigned char>(name.front())) != 0) return "Relief" + name;
  return "relief_" + name.substr(name.find_first_not_of('_'));
}

void prefix_names(Pieces& pieces) {
  std::map<std::string, std::string, std::less<>> names;
  for (const Piece& piece : pieces)
    if (piece.is_needed && !piece.text.starts_with('#') && !piece.text.starts_with("using ") &&
        !piece.text.starts_with("precision "))
      for (const std::string& name : piece.names) names.emplace(name, prefixed_name(name));
  for (Piece& piece : pieces) {
    piece.text = rewritten(piece.text, [&](const Word& word) {
      const auto found = names.find(word.text);
      return word.is_member() || found == names.end() ? same(word) : Replacement{found->second};
    });
    for (std::string& name : piece.names)
      if (const auto found = names.find(name); found != names.end()) name = found->second;
  }
}

namespace {

/// A function of one line as three, where the line is too long.
std::vector<std::string> opened(const std::string& line) {
  const std::size_t open = line.find(") { ");
  if (line.size() <= kLineEnd || line.starts_with(' ') || open == std::string::npos || !line.ends_with(" }"))
    return {line};
  return {line.substr(0, open + 3), "  " + line.substr(open + 4, line.size() - open - 6), "}"};
}

}  // namespace

std::string with_short_lines(const std::string& text) {
  std::string out;
  std::vector<std::string> lines;
  for (const std::string& line : text_lines(text)) std::ranges::copy(opened(line), std::back_inserter(lines));
  for (std::string line : lines) {
    const std::string indent(std::min(line.find_first_not_of(' '), line.size()) + 4, ' ');
    while (line.size() > kLineEnd && !line.starts_with('#')) {
      const std::size_t comma = std::min(code_of(line).size(), kLineEnd) < 2
                                    ? std::string::npos
                                    : line.rfind(", ", std::min(code_of(line).size(), kLineEnd) - 2);
      if (comma == std::string::npos || comma <= indent.size()) break;
      out.append(line, 0, comma + 1).append("\n");
      line.replace(0, comma + 2, indent);
    }
    out.append(line).append("\n");
  }
  return out;
}

}  // namespace reliefbench
