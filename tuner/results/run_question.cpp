#include "tuner/results/run_question.h"

namespace reliefbench {
namespace {

using nlohmann::json;

/// The bounds that a list of texts says; nothing where there is none.
std::vector<Budget> budgets_at(const json& document, const char* pointer) {
  const json::json_pointer at(pointer);
  if (!document.contains(at)) return {};
  return parse_budgets(document.at(at).get<std::vector<std::string>>());
}

}  // namespace

RunQuestion question_of(const json& info) {
  const Config defaults;
  RunQuestion question{.error_metric = defaults.front_error,
                       .constraints = defaults.front_constraints,
                       .budgets = budgets_at(info, "/identity/tune/max_error")};
  if (info.is_object()) question.error_metric = info.value(json::json_pointer("/front/error"), question.error_metric);
  if (info.contains(json::json_pointer("/front/constraints")))
    question.constraints = budgets_at(info, "/front/constraints");
  if (question.budgets.empty()) question.budgets = budgets_at(info, "/budgets");
  if (question.budgets.empty()) question.budgets = defaults.budgets;
  return question;
}

RunQuestion question_of(const Run& run) { return question_of(run.info); }

bool is_of_tune(const Run& run) { return run.info.contains(json::json_pointer("/identity/tune")); }

}  // namespace reliefbench
