#include "reports/viewer/view_script.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>

#include "kernels/base/error.h"
#include "kernels/base/suggest.h"

namespace reliefbench {
namespace {

constexpr std::array kVerbs{
    VerbRow{"set", Verb::set, "NAME VALUE", 0, 2, "a control by its name; the word set may be left out"},
    VerbRow{"orbit", Verb::orbit, "AZIMUTH ELEVATION", 2, 0, "turn the camera by so many degrees"},
    VerbRow{"zoom", Verb::zoom, "NOTCHES", 1, 0, "come nearer, a tenth each"},
    VerbRow{"pan", Verb::pan, "SIDES", 1, 0, "move along u, in sides of the plane"},
    VerbRow{"wait", Verb::wait, "", 0, 0, "until maps, pictures and errors of what is chosen are there"},
    VerbRow{"frames", Verb::frames, "N", 1, 0, "show N frames at rest, and print how many a second"},
    VerbRow{"turn", Verb::turn, "N", 1, 0, "show N frames, a degree of azimuth each, and print how many a second"},
    VerbRow{"screenshot", Verb::screenshot, "NAME", 0, 1, "wait, then write the window as NAME.png"},
    VerbRow{"copy", Verb::copy, "case|config|preset FILE", 0, 2, "write what the button copies"},
    VerbRow{"quit", Verb::quit, "", 0, 0, "close the window"}};
constexpr double kMostFrames = 100000;

std::vector<std::string> script_words(std::string_view line) {
  std::istringstream stream{std::string(line.substr(0, line.find('#')))};
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

double number_of(const std::string& word) {
  double value = 0;
  const char* const last = word.data() + word.size();
  const auto [end, fault] = std::from_chars(word.data(), last, value);
  if (fault != std::errc() || end != last || !std::isfinite(value)) fail_input("'{}' is no number", word);
  return value;
}

void check(const ScriptLine& line) {
  const bool counts = line.verb == Verb::frames || line.verb == Verb::turn;
  if (counts && !(line.numbers[0] >= 1 && line.numbers[0] <= kMostFrames))
    fail_input("{} is not a number of frames from 1 to {}", line.numbers[0], kMostFrames);
  if (line.verb != Verb::copy) return;
  if (std::ranges::find(copied_kinds(), line.words[0]) == copied_kinds().end())
    fail_input("'{}' is {}", line.words[0], unknown_text(line.words[0], copied_kinds()));
}

/// words: not empty
ScriptLine parse_line(const std::vector<std::string>& words, std::string place) {
  const auto* row = std::ranges::find(kVerbs, words[0], &VerbRow::id);
  std::size_t next = 1;
  if (row == kVerbs.end() && words.size() == 2) {  // "split .3"
    row = kVerbs.data();
    next = 0;
  }
  if (row == kVerbs.end()) fail_input("'{}' is {}", words[0], unknown_text(words[0], ids_of(kVerbs)));
  ScriptLine line{.place = std::move(place), .verb = row->verb};
  const int arguments = row->numbers + row->words;
  if (words.size() - next != static_cast<std::size_t>(arguments))
    fail_input("expected '{}{}{}'", row->id, row->arguments.empty() ? "" : " ", row->arguments);
  for (int i = 0; i < row->numbers; ++i) line.numbers.push_back(number_of(words[next++]));
  for (int i = 0; i < row->words; ++i) line.words.push_back(words[next++]);
  check(line);
  return line;
}

}  // namespace

std::vector<VerbRow> verbs() { return {kVerbs.begin(), kVerbs.end()}; }

const std::vector<std::string_view>& copied_kinds() {
  static const std::vector<std::string_view> kinds = {"case", "config", "preset"};
  return kinds;
}

std::vector<ScriptLine> parse_script(std::string_view text, std::string_view file, ViewChoice choice,
                                     const ViewPicks& picks) {
  std::vector<ScriptLine> lines;
  std::istringstream stream{std::string(text)};
  int number = 0;
  for (std::string line; std::getline(stream, line);) {
    ++number;
    const std::vector<std::string> words = script_words(line);
    if (words.empty()) continue;
    std::string place = fmt::format("{}:{}", file, number);
    try {
      lines.push_back(parse_line(words, place));
    } catch (const Error& error) {
      fail_input("{}: {}", place, error.what());
    }
    apply(lines.back(), choice, picks);
  }
  return lines;
}

void apply(const ScriptLine& line, ViewChoice& choice, const ViewPicks& picks) {
  try {
    Scene& scene = choice.spec.scene;
    if (line.verb == Verb::set) set(choice, picks, line.words[0], line.words[1]);
    if (line.verb == Verb::orbit) orbit(scene, line.numbers[0], line.numbers[1]);
    if (line.verb == Verb::zoom) zoom(scene, line.numbers[0]);
    if (line.verb == Verb::pan) pan(scene, line.numbers[0]);
    const bool shows = line.verb == Verb::wait || line.verb == Verb::screenshot;
    for (const Settings* settings : {&choice.settings, choice.other ? &*choice.other : nullptr}) {
      if (!shows || settings == nullptr) continue;
      if (const std::string reason = conflict(*settings); !reason.empty()) fail_input("{}", reason);
    }
  } catch (const Error& error) {
    fail_input("{}: {}", line.place, error.what());
  }
}

}  // namespace reliefbench
