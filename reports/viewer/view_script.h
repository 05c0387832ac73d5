#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "reports/viewer/view_choice.h"

namespace reliefbench {

/// What a line of a script does.
enum class Verb { set, orbit, zoom, pan, wait, frames, turn, screenshot, copy, quit };

/// A verb as scripts have it: a row here is all that reading and help know of it.
struct VerbRow {
  std::string_view id;
  Verb verb;
  std::string_view arguments;  ///< as help shows them
  int numbers;                 ///< how many of its arguments are numbers; they come first
  int words;                   ///< ... and how many other words follow
  std::string_view description;
};
[[nodiscard]] std::vector<VerbRow> verbs();

/// One line.
struct ScriptLine {
  std::string place;  ///< "tour.txt:3", for messages
  Verb verb;
  std::vector<double> numbers{};
  std::vector<std::string> words{};  ///< of set: name and value
};

/// A line a verb; '#' begins a comment. A name of set() in the place of a verb sets it: "split .3", "overlay error".
/// The whole script is tried on `choice` first, so that what is wrong with it is known before anything is opened.
/// file: for messages
/// throws: Error(bad_input) "FILE:LINE: ..."
[[nodiscard]] std::vector<ScriptLine> parse_script(std::string_view text, std::string_view file, ViewChoice choice,
                                                   const ViewPicks& picks);

/// Does what a line says of the choice; nothing where it says nothing of that. throws: Error(bad_input) with its place
void apply(const ScriptLine& line, ViewChoice& choice, const ViewPicks& picks);

/// What a script may copy: "case", "config", "preset".
[[nodiscard]] const std::vector<std::string_view>& copied_kinds();

}  // namespace reliefbench
