#include "tuner/plan/claims_config.h"

#include <algorithm>
#include <array>

#include "kernels/base/error.h"
#include "kernels/base/json_lines.h"
#include "kernels/judge/metric.h"
#include "tuner/plan/config_assets.h"
#include "tuner/plan/config_reader.h"

namespace reliefbench {
namespace {

constexpr std::array<std::string_view, 4> kOwnMetrics{"frame_time", "bake_time", "mean_ratio", "too_wide"};

std::string read_metric(const ConfigReader& reader, const JsonNode& node) {
  std::string id = reader.text(node);
  if (!is_claim_metric(id)) reader.fail(node, fmt::format("no metric '{}'", id));
  return id;
}

/// "cone?cone_steps=32&step=plain"
Settings read_settings(const ConfigReader& reader, const JsonNode& node) {
  const std::string text = reader.text(node);
  return reader.at(node, [&] {
    const std::size_t question = text.find('?');
    Settings settings(find_technique(std::string_view(text).substr(0, question)));
    std::string_view rest = question == std::string::npos ? "" : std::string_view(text).substr(question + 1);
    while (!rest.empty()) {
      const std::string_view term = rest.substr(0, rest.find('&'));
      rest.remove_prefix(std::min(rest.size(), term.size() + 1));
      const std::size_t equals = std::min(term.find('='), term.size() - 1);
      settings.set(term.substr(0, equals), term.substr(equals + 1));
    }
    if (const std::string reason = conflict(settings); !reason.empty()) fail_input("{}", reason);
    return settings;
  });
}

ClaimRow read_row(const ConfigReader& reader, const JsonNode& node) {
  reader.check_keys(node, {"label", "settings", "paper"});
  ClaimRow row{.label = reader.text(reader.required(node, "label")),
               .settings = read_settings(reader, reader.required(node, "settings")),
               .paper = {}};
  if (const JsonNode* paper = node.find("paper"))
    for (const JsonNode& figure : paper->children) {
      if (!is_claim_metric(figure.key)) reader.fail(figure, fmt::format("no metric '{}'", figure.key));
      row.paper[figure.key] = reader.number(figure, {});
    }
  return row;
}

ClaimCheck read_check(const ConfigReader& reader, const JsonNode& node, const std::vector<ClaimRow>& rows) {
  reader.check_keys(node, {"says", "metric", "of", "than", "to", "quotient", "tolerance", "at_most", "beaten_by"});
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
  if (check.of.empty()) reader.fail(node, "'of' is missing");
  if (const JsonNode* bound = node.find("at_most")) check.at_most = reader.number(*bound, {});
  if (!check.to.empty()) {
    check.quotient = reader.number(reader.required(node, "quotient"), {.low = 0, .above_low = true});
    check.tolerance = reader.number(reader.required(node, "tolerance"), {.low = 0});
  }
  if (const JsonNode* others = node.find("beaten_by"))
    for (const JsonNode& other : reader.items(*others)) check.beaten_by.push_back(labelled(other));
  const int forms = (check.than.empty() ? 0 : 1) + (check.to.empty() ? 0 : 1) + (check.at_most ? 1 : 0) +
                    (check.beaten_by.empty() ? 0 : 1);
  if (forms != 1) reader.fail(node, "expected one of 'than', 'to', 'at_most' and 'beaten_by'");
  return check;
}

}  // namespace

bool is_claim_metric(std::string_view id) {
  return std::ranges::find(kOwnMetrics, id) != kOwnMetrics.end() ||
         std::ranges::any_of(metrics(), [&](const MetricRow& row) { return row.id == id; });
}

Claim parse_claim(const std::string& text, const std::filesystem::path& path) {
  const ConfigReader reader(path.string());
  const JsonNode root = parse_json_lines(text, path.string());
  reader.check_keys(root, {"source", "about", "scene", "metrics", "rows", "checks"});
  const JsonNode& scene = reader.required(root, "scene");
  std::vector<SceneSpec> scenes = read_scene(reader, scene, path.parent_path());
  if (scenes.size() != 1) reader.fail(scene, "expected one view");
  Claim claim{.id = path.stem().string(),
              .source = reader.text(reader.required(root, "source")),
              .about = reader.text(reader.required(root, "about")),
              .scene = std::move(scenes.front()),
              .metrics = {},
              .rows = {},
              .checks = {}};
  for (const JsonNode& metric : reader.items(reader.required(root, "metrics")))
    claim.metrics.push_back(read_metric(reader, metric));
  for (const JsonNode& row : reader.items(reader.required(root, "rows"))) claim.rows.push_back(read_row(reader, row));
  for (const JsonNode& check : reader.items(reader.required(root, "checks")))
    claim.checks.push_back(read_check(reader, check, claim.rows));
  return claim;
}

std::vector<Claim> built_in_claims() {
  std::vector<Claim> claims;
  for (const EmbeddedFile& file : embedded_claims())
    claims.push_back(parse_claim(std::string(file.text), std::filesystem::path("configs/claims") / file.name));
  return claims;
}

}  // namespace reliefbench
