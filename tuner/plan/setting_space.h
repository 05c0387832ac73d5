#pragma once
#include <string>
#include <vector>

#include "kernels/judge/score.h"
#include "kernels/trace/technique.h"
#include "tuner/plan/case.h"
#include "tuner/search/space.h"

namespace reliefbench {

/// The metrics that count work, by the registry's order: a space's work axes.
[[nodiscard]] std::vector<const MetricRow*> work_metrics();

/// A space without candidates whose axes are those of the registry: "technique" and every parameter with named choices
/// as categories, every integer parameter as steps, in the order in which the techniques first have them.
[[nodiscard]] SearchSpace empty_setting_space();

/// Settings as a candidate of such a space, without its error; its work is 0.
[[nodiscard]] Candidate candidate_of(const Settings& settings, std::string id);

/// Takes the axes that none of the candidates has out of a filled space: it then is the one that it was before there
/// were such parameters.
void drop_unused_axes(SearchSpace& space);

/// "cone?cone_steps=32&...": settings without the scene and the backend of a case.
[[nodiscard]] std::string setting_id(const Settings& settings);
/// The settings of a setting's or a case's id. throws: Error(bad_input): no such technique, parameter or value
[[nodiscard]] Settings parse_setting(std::string_view id);

/// The case of an id; its scene and backend are empty where the id does not say them.
/// throws: Error(bad_input): as parse_setting()
[[nodiscard]] Case parse_case(std::string_view id);

}  // namespace reliefbench
