#include "tuner/plan/claims_config.h"

#include <algorithm>
#include <array>

#include "kernels/base/error.h"
#include "kernels/base/json_document.h"
#include "kernels/judge/metric.h"
#include "tuner/plan/config_assets.h"
#include "tuner/plan/config_reader.h"
#include "tuner/plan/plan.h"
#include "tuner/plan/setting_space.h"

namespace reliefbench {
namespace {

constexpr std::array<std::string_view, 6> kOwnMetrics{"frame_time", "bake_time",  "mean_ratio",
                                                      "too_wide",   "violations", "undecided"};

std::string read_metric(const ConfigReader& reader, const JsonNode& node) {
  std::string id = reader.text(node);
  if (!is_claim_metric(id)) reader.fail(node, fmt::format("no metric '{}'", id));
  return id;
}

/// "cone?cone_steps=32&step=plain"
Settings read_settings(const ConfigReader& reader, const JsonNode& node) {
  const std::string text = reader.text(node);
  return reader.at(node, [&] {
    Settings settings = parse_setting(text);
    if (const std::string reason = conflict(settings); !reason.empty()) fail_input("{}", reason);
    return settings;
  });
}

ClaimRow read_row(const ConfigReader& reader, const JsonNode& node) {
  reader.check_keys(node, {"label", "settings", "paper", "source"});
  ClaimRow row{.label = reader.text(reader.required(node, "label")),
               .settings = read_settings(reader, reader.required(node, "settings")),
               .paper = {}};
  if (const JsonNode* source = node.find("source")) row.source = reader.text(*source);
  if (const JsonNode* paper = node.find("paper"))
    for (const JsonNode& figure : paper->children) {
      if (!is_claim_metric(figure.key)) reader.fail(figure, fmt::format("no metric '{}'", figure.key));
      row.paper[figure.key] = reader.number(figure, {});
    }
  return row;
}

bool is_whole_contest(const ClaimCheck& check) {
  const bool has_each = !check.of_each.empty();
  const bool has_best = !check.best_of.empty();
  const bool has_of = !check.of.empty();
  const bool has_rather = !check.rather_than.empty();
  if (!check.is_contest() || !(check.than + check.to).empty() || has_best != check.at_most.has_value()) return false;
  if (check.by_factor > 0) return has_each != has_best && !has_of && !has_rather;
  return has_each != has_of && !has_best && (has_each || !has_rather);
}

/// What is read of one: a check, or one of each row that it is of.
std::vector<ClaimCheck> spread(ClaimCheck check) {
  if (check.of_each.empty() || !check.rather_than.empty() || check.by_factor > 0) return {std::move(check)};
  constexpr std::string_view kLabel = "{}";
  std::vector<ClaimCheck> list;
  list.reserve(check.of_each.size());
  for (const std::string& label : check.of_each) {
    ClaimCheck& one = list.emplace_back(check);
    one.of_each.clear();
    one.of = label;
    if (const std::size_t at = one.says.find(kLabel); at != std::string::npos)
      one.says.replace(at, kLabel.size(), label);
  }
  return list;
}

std::vector<ClaimCheck> read_check(const ConfigReader& reader, const JsonNode& node,
                                   const std::vector<ClaimRow>& rows) {
  reader.check_keys(node, {"says", "why", "metric", "of", "than", "to", "quotient", "tolerance", "at_most", "beaten_by",
                           "of_each", "best_of", "rather_than", "by_factor"});
  const auto labelled = [&](const JsonNode& child) {
    std::string text = reader.text(child);
    if (std::ranges::find(rows, text, &ClaimRow::label) == rows.end())
      reader.fail(child, fmt::format("no row is labelled '{}'", text));
    return text;
  };
  const auto label = [&](std::string_view key) {
    const JsonNode* const child = node.find(key);
    return child == nullptr ? std::string() : labelled(*child);
  };
  ClaimCheck check{.says = reader.text(reader.required(node, "says")),
                   .metric = read_metric(reader, reader.required(node, "metric")),
                   .of = label("of"),
                   .than = label("than"),
                   .to = label("to")};
  const auto labels = [&](std::string_view key) {
    std::vector<std::string> list;
    if (const JsonNode* others = node.find(key))
      for (const JsonNode& other : reader.items(*others)) {
        const std::size_t before = list.size();
        for (const ClaimRow& row : rows)
          if (glob_matches(reader.text(other), row.label)) list.push_back(row.label);
        if (list.size() == before) list.push_back(labelled(other));
      }
    return list;
  };
  if (const JsonNode* why = node.find("why")) check.why = reader.text(*why);
  check.beaten_by = labels("beaten_by");
  check.of_each = labels("of_each");
  check.best_of = labels("best_of");
  check.rather_than = labels("rather_than");
  if (const JsonNode* factor = node.find("by_factor"))
    check.by_factor = reader.number(*factor, {.low = 0, .above_low = true});
  if (const JsonNode* bound = node.find("at_most")) check.at_most = reader.number(*bound, {});
  if (!check.to.empty() && !check.at_most) {
    check.quotient = reader.number(reader.required(node, "quotient"), {.low = 0, .above_low = true});
    check.tolerance = reader.number(reader.required(node, "tolerance"), {.low = 0});
  }
  const bool has_list = !(check.of_each.empty() && check.best_of.empty() && check.rather_than.empty());
  if (check.is_contest() || has_list || check.by_factor > 0) {
    if (!is_whole_contest(check))
      reader.fail(node,
                  "'beaten_by' goes with 'of'; or with 'of_each', and 'rather_than' or 'by_factor'; or with 'best_of', "
                  "'at_most' and 'by_factor'");
    return spread(std::move(check));
  }
  if (check.of.empty()) reader.fail(node, "'of' is missing");
  const int forms = (check.than.empty() ? 0 : 1) + (check.to.empty() && !check.at_most ? 0 : 1);
  if (forms != 1) reader.fail(node, "expected one of 'than', 'to', 'at_most' and 'beaten_by'");
  return {std::move(check)};
}

}  // namespace

bool is_claim_metric(std::string_view id) {
  return std::ranges::find(kOwnMetrics, id) != kOwnMetrics.end() ||
         std::ranges::any_of(metrics(), [&](const MetricRow& row) { return row.id == id; });
}

bool Claim::is_contest() const { return std::ranges::all_of(checks, &ClaimCheck::is_contest); }

bool Claim::asks_for(std::string_view metric) const {
  return std::ranges::find(metrics, metric) != metrics.end() ||
         std::ranges::find(checks, metric, &ClaimCheck::metric) != checks.end();
}

std::size_t Claim::row_index(std::string_view label) const {
  return static_cast<std::size_t>(std::ranges::find(rows, label, &ClaimRow::label) - rows.begin());
}

Claim parse_claim(const std::string& text, const std::filesystem::path& path) {
  const ConfigReader reader(path.string());
  const JsonNode root = parse_json_document(text, path.string());
  reader.check_keys(root, {"source", "about", "scene", "scenes", "metrics", "rows", "checks"});
  std::vector<SceneSpec> scenes;
  const JsonNode* const list = root.find("scenes");
  const JsonNode& first = list == nullptr ? reader.required(root, "scene") : *list;
  if (list == nullptr) {
    scenes = read_scene(reader, first, path.parent_path());
  } else {
    for (const JsonNode& one : reader.items(*list))
      for (SceneSpec& scene : read_scene(reader, one, path.parent_path())) scenes.push_back(std::move(scene));
  }
  Claim claim{.id = path.stem().string(),
              .source = reader.text(reader.required(root, "source")),
              .about = reader.text(reader.required(root, "about")),
              .scenes = std::move(scenes),
              .metrics = {},
              .rows = {},
              .checks = {}};
  if (claim.scenes.empty()) reader.fail(first, "expected at least one scene");
  for (const JsonNode& metric : reader.items(reader.required(root, "metrics")))
    claim.metrics.push_back(read_metric(reader, metric));
  for (const JsonNode& row : reader.items(reader.required(root, "rows"))) claim.rows.push_back(read_row(reader, row));
  for (const JsonNode& node : reader.items(reader.required(root, "checks")))
    for (ClaimCheck& check : read_check(reader, node, claim.rows)) claim.checks.push_back(std::move(check));
  return claim;
}

std::vector<Claim> built_in_claims() {
  std::vector<Claim> claims;
  for (const EmbeddedFile& file : embedded_claims())
    claims.push_back(parse_claim(std::string(file.text), std::filesystem::path("configs/claims") / file.name));
  return claims;
}

}  // namespace reliefbench
