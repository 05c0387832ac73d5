#include "tuner/decide/recommend.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <tuple>

#include "kernels/base/clock.h"
#include "tuner/decide/choose.h"
#include "tuner/decide/pareto.h"

namespace reliefbench {
namespace {

bool measured(const Record& record) { return record.status == Status::ok && record.frame_time && record.error; }

/// Lower is better, whatever the metric's direction.
double badness(const Record& record, const std::string& metric_id) {
  const std::optional<double> value = metric_value(record, metric_id);
  const MetricRow& metric = find_metric(metric_id);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (!value) return metric.none_is_best() ? -kInfinity : kInfinity;
  return metric.lower_is_better ? *value : -*value;
}

bool answers_question(const Record& record, const Question& question) {
  if (question.max_time_ms && judged_time_ns(record) > *question.max_time_ms * kNsPerMs) return false;
  const auto met = [&](const Budget& budget) { return meets(record, budget); };
  return std::all_of(question.budgets.begin(), question.budgets.end(), met);
}

bool is_better(const Record& a, const Record& b, const Question& question) {
  const double time_a = judged_time_ns(a);
  const double time_b = judged_time_ns(b);
  const double error_a = badness(a, question.error_metric);
  const double error_b = badness(b, question.error_metric);
  if (question.max_time_ms) return std::tie(error_a, time_a, a.case_id) < std::tie(error_b, time_b, b.case_id);
  return std::tie(time_a, error_a, a.case_id) < std::tie(time_b, error_b, b.case_id);
}

Choice choose_of(std::span<const Record* const> records) {
  std::vector<Contender> contenders;
  for (const Record* record : records)
    contenders.push_back({.simplicity = simplicity(*record),
                          .memory_bytes = record->memory_bytes,
                          .low_ns = record->frame_time->summary.ci_low,
                          .high_ns = judged_time_ns(*record)});
  return choose(contenders);
}

/// meeting: sorted best first, not empty
void set_picks(Answer& answer, std::span<const Record* const> meeting, const Question& question) {
  const auto is_as_good = [&](const Record* record) {  // errors are exact: only times can tie
    return !question.max_time_ms ||
           badness(*record, question.error_metric) == badness(*meeting.front(), question.error_metric);
  };
  const auto end = std::ranges::find_if_not(meeting, is_as_good);
  const std::span<const Record* const> best = meeting.first(static_cast<std::size_t>(end - meeting.begin()));
  const Choice choice = choose_of(best);
  answer.pick = best[choice.pick];
  if (choice.tie) answer.tie = best[*choice.tie];
  answer.ties = choice.ties;
  for (const Record* record : meeting)
    if (record != answer.pick && answer.runner_up == nullptr) answer.runner_up = record;
  Simplicity least;
  for (const Record* record : meeting) {
    const auto met = [&](const Budget& budget) { return meets(*record, budget); };
    if (!std::ranges::all_of(question.simplest_budgets, met)) continue;
    const Simplicity own = simplicity(*record);
    if (answer.simplest != nullptr && !(own < least)) continue;
    answer.simplest = record;
    least = own;
  }
}

double worst_miss(const Record& record, const Question& question) {
  const double worst = miss_of(question.budgets, *record.error).worst;
  if (!question.max_time_ms) return worst;
  const double excess_ms = judged_time_ns(record) / kNsPerMs - *question.max_time_ms;
  return std::max(worst, relative_miss(excess_ms, *question.max_time_ms));
}

/// Of the records that are faster than the pick and miss what is asked, the one that misses least; null: none does.
const Record* least_miss(std::span<const Record* const> records, const Record& pick, const Question& question) {
  const Record* least = nullptr;
  for (const Record* record : records) {
    if (answers_question(*record, question) || judged_time_ns(*record) >= judged_time_ns(pick)) continue;
    if (least == nullptr || worst_miss(*record, question) < worst_miss(*least, question)) least = record;
  }
  return least;
}

std::string miss_text(const Record& record, const Question& question) {
  std::string text = miss_of(question.budgets, *record.error).text;
  const double time_ms = judged_time_ns(record) / kNsPerMs;
  if (question.max_time_ms && time_ms > *question.max_time_ms)
    text += fmt::format("{}frame time is up to {:.4g} ms where {:.4g} ms is asked", text.empty() ? "" : ", ", time_ms,
                        *question.max_time_ms);
  return text;
}

Answer answer_of(const RecordGroup& group, const Question& question) {
  Answer answer{.backend = group.backend, .device = group.device, .scene = group.scene, .scene_key = group.scene_key};
  std::vector<const Record*> all;
  std::copy_if(group.records.begin(), group.records.end(), std::back_inserter(all),
               [](const Record* record) { return measured(*record); });
  if (all.empty()) {
    const Record& first = *group.records.front();
    answer.miss = fmt::format("no case was measured, of {}; the first is {}{}{}", group.records.size(),
                              status_id(first.status), first.reason.empty() ? "" : ": ", first.reason);
    return answer;
  }

  const auto better = [&](const Record* a, const Record* b) { return is_better(*a, *b, question); };
  std::sort(all.begin(), all.end(), better);
  for (const Record* record : all) {
    const bool faster = answer.flat == nullptr || judged_time_ns(*record) < judged_time_ns(*answer.flat);
    if (record->technique == "flat" && faster) answer.flat = record;
  }

  // `all` is sorted best first, so the first of each kind is the best of its kind.
  std::vector<const Record*> meeting;
  std::copy_if(all.begin(), all.end(), std::back_inserter(meeting),
               [&](const Record* record) { return answers_question(*record, question); });
  if (meeting.empty()) {
    answer.nearest = *std::min_element(all.begin(), all.end(), [&](const Record* a, const Record* b) {
      return worst_miss(*a, question) < worst_miss(*b, question);
    });
    answer.miss = miss_text(*answer.nearest, question);
    return answer;
  }
  set_picks(answer, meeting, question);
  answer.just_fails = least_miss(all, *answer.pick, question);
  answer.simpler = static_cast<std::size_t>(std::ranges::count_if(
      all, [own = simplicity(*answer.pick)](const Record* record) { return simplicity(*record) < own; }));
  return answer;
}

nlohmann::json record_or_null(const Record* record) {
  if (record == nullptr) return {};
  nlohmann::json json = *record;
  json["frame_time_ns"]["coverage"] = interval_coverage(record->frame_time->summary.n);
  return json;
}

}  // namespace

double judged_time_ns(const Record& record) {
  if (!record.frame_time) fail_input("case {} has no frame time to judge", record.case_id);
  return record.frame_time->summary.ci_high;
}

double rebake_ns(const Record& record) { return record.device_bake_ns.value_or(record.bake_time_ns); }

void add_bakes(std::span<Record> records, int rebake_every) {
  for (Record& record : records) {
    if (!record.frame_time) continue;
    const double share_ns = rebake_ns(record) / rebake_every;
    Summary& sum = record.frame_time->summary;
    for (double* time_ns : {&sum.median, &sum.ci_low, &sum.ci_high}) *time_ns += share_ns;
  }
}

std::vector<Answer> recommend(std::span<const Record> records, const Question& question) {
  // Unknown names are refused here even when no record would ask for them.
  (void)find_metric(question.error_metric);
  for (const Budget& budget : question.budgets) (void)find_metric(budget.metric);
  std::vector<Answer> answers;
  for (const RecordGroup& group : group_records(records)) answers.push_back(answer_of(group, question));
  return answers;
}

Exit exit_of(std::span<const Answer> answers) {
  const auto is_measured = [](const Answer& answer) { return answer.pick != nullptr || answer.nearest != nullptr; };
  const auto is_answered = [](const Answer& answer) { return answer.pick != nullptr; };
  if (std::none_of(answers.begin(), answers.end(), is_measured)) return Exit::nothing_measured;
  return std::all_of(answers.begin(), answers.end(), is_answered) ? Exit::done : Exit::answer_is_no;
}

nlohmann::json answers_json(std::span<const Answer> answers, const Question& question) {
  nlohmann::json asked = {{"budgets", budget_texts(question.budgets)},
                          {"error_metric", question.error_metric},
                          {"simplest_budgets", budget_texts(question.simplest_budgets)}};
  asked["max_time_ms"] = question.max_time_ms ? nlohmann::json(*question.max_time_ms) : nlohmann::json();
  asked["rebake_every"] = question.rebake_every ? nlohmann::json(*question.rebake_every) : nlohmann::json();

  nlohmann::json list = nlohmann::json::array();
  for (const Answer& answer : answers) {
    list.push_back({{"backend", answer.backend},
                    {"device", answer.device},
                    {"scene", answer.scene},
                    {"scene_key", answer.scene_key.hex},
                    {"pick", record_or_null(answer.pick)},
                    {"tie", record_or_null(answer.tie)},
                    {"ties", answer.ties},
                    {"runner_up", record_or_null(answer.runner_up)},
                    {"simplest", record_or_null(answer.simplest)},
                    {"simpler_measured", answer.simpler},
                    {"flat", record_or_null(answer.flat)},
                    {"nearest", record_or_null(answer.nearest)},
                    {"miss", answer.miss}});
  }
  return {{"schema", kSchemaVersion}, {"question", std::move(asked)}, {"answers", std::move(list)}};
}

}  // namespace reliefbench
