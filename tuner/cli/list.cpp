#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "backends/backend.h"
#include "backends/gpu_bake.h"
#include "kernels/base/suggest.h"
#include "kernels/image/heightmap.h"
#include "kernels/judge/score.h"
#include "kernels/maps/map_kind.h"
#include "kernels/maps/texel.h"
#include "kernels/trace/surface.h"
#include "kernels/trace/technique.h"
#include "kernels/trace/view.h"
#include "reports/export/engine.h"
#include "tuner/cli/commands.h"
#include "tuner/cli/format.h"
#include "tuner/cli/options.h"

namespace reliefbench {
namespace {

// Keys keep their order: they are the columns.
using Json = nlohmann::ordered_json;

Json parameter_row(const Param& param) {
  const std::string values = param.choices.empty() ? fmt::format("{}..{}", param.min, param.max)
                                                   : fmt::format("{}", fmt::join(param.choices, " | "));
  return {{"id", param.id},
          {"values", values},
          {"default", param.text(param.fallback)},
          {"stage", param.stage == Stage::bake ? "bake" : "run"},
          {"active_if", param.active_if},
          {"description", param.description}};
}

std::string parameter_ids(const FeatureRow& row) {
  std::vector<std::string_view> ids;
  ids.reserve(row.params.size());
  for (const Param& param : row.params) ids.push_back(param.id);
  return fmt::format("{}", fmt::join(ids, " | "));
}

Json feature_rows() {
  Json rows = Json::array();
  for (const Feature& feature : all_features())
    for (const FeatureRow& row : feature.rows)
      rows.push_back({{"id", fmt::format("{}={}", feature.id, row.id)},
                      {"parameters", parameter_ids(row)},
                      {"also", row.also},
                      {"caveat", row.caveat},
                      {"source", row.source},
                      {"description", row.description}});
  return rows;
}

std::vector<std::string_view> map_ids(const Technique& technique) {
  std::vector<std::string_view> ids;
  for (const MapKind map : technique.maps) ids.push_back(find_map(map).id);
  return ids;
}

Json technique_rows() {
  Json rows = Json::array();
  for (const Technique& technique : techniques()) {
    Json parameters = Json::array();
    for (const Param& param : technique.params) parameters.push_back(parameter_row(param));
    rows.push_back({{"id", technique.id},
                    {"description", technique.description},
                    {"maps", fmt::format("{}", fmt::join(map_ids(technique), " | "))},
                    {"guarantee", guarantee_id(technique.guarantee)},
                    {"guarantee_note", technique.guarantee_note},
                    {"source", technique.source},
                    {"parameters", std::move(parameters)}});
  }
  return rows;
}

Json map_rows() {
  Json rows = Json::array();
  for (const MapRow& map : map_kinds()) {
    std::vector<std::string_view> corrections;
    for (const Correction correction : map.corrections) corrections.push_back(correction_id(correction));
    std::vector<std::string_view> parameters;
    for (const MapParam& param : map.parameters) parameters.push_back(param.id);
    rows.push_back({{"id", map.id},
                    {"ratios", map.ratios},
                    {"corrections", fmt::format("{}", fmt::join(corrections, " | "))},
                    {"parameters", fmt::format("{}", fmt::join(parameters, " | "))},
                    {"gpu_baker", has_gpu_baker(map.kind)},
                    {"guarantee", map.guarantee},
                    {"source", map.source},
                    {"description", map.description}});
  }
  return rows;
}

Json metric_rows() {
  Json rows = Json::array();
  for (const MetricRow& metric : metrics()) {
    rows.push_back({{"id", metric.id},
                    {"unit", metric.unit},
                    {"better", metric.lower_is_better ? "lower" : "higher"},
                    {"description", metric.description}});
  }
  return rows;
}

Json format_rows() {
  Json rows = Json::array();
  for (const Format& format : formats()) {
    rows.push_back({{"id", format.id},
                    {"bytes_per_texel", format.bits_per_texel() % 8 == 0 ? Json(format.bits_per_texel() / 8)
                                                                         : Json(format.bits_per_texel() / 8.0)},
                    {"ratios", format.ratios()},
                    {"normal", format.with_normal}});
  }
  return rows;
}

Json encoding_rows() {
  Json rows = Json::array();
  for (const Encoding& encoding : encodings()) rows.push_back({{"id", encoding.id}, {"source", encoding.source}});
  return rows;
}

Json heightmap_rows() {
  Json rows = Json::array();
  for (const KnownHeightmapRow& map : known_heightmaps()) {
    rows.push_back({{"id", map.id}, {"kind", "file"}, {"description", fmt::format("{}: {}", map.file, map.origin)}});
  }
  for (const ProceduralRow& map : procedurals()) {
    rows.push_back({{"id", map.id}, {"kind", "procedural"}, {"description", map.description}});
  }
  return rows;
}

Json surface_rows() {
  const Surface usual;
  Json rows = Json::array();
  for (const SurfaceRow& row : surfaces())
    rows.push_back({{"id", row.id},
                    {"round", row.has_round ? fmt::format("{:g}", usual.round) : "-"},
                    {"tube", row.has_tube ? fmt::format("{:g}", usual.tube) : "-"},
                    {"mesh", row.has_mesh ? usual.mesh : "-"},
                    {"segments", row.has_mesh ? fmt::format("{}", usual.segments) : "-"},
                    {"source", row.source},
                    {"description", row.description}});
  return rows;
}

Json view_rows() {
  Json rows = Json::array();
  for (const View& view : view_presets()) {
    rows.push_back({{"id", view.id},
                    {"elevation_deg", view.elevation_deg},
                    {"distance", view.distance},
                    {"fov_deg", view.fov_deg}});
  }
  return rows;
}

Json backend_rows() {
  Json rows = Json::array();
  for (const BackendRow& backend : backends()) {
    rows.push_back({{"id", backend.id}, {"real", backend.real}, {"description", backend.description}});
  }
  return rows;
}

Json engine_rows() {
  Json rows = Json::array();
  for (const Engine& engine : engines()) {
    rows.push_back({{"id", engine.id},
                    {"language", engine.language.empty() ? "any" : engine.language},
                    {"textures", fmt::format("{}", fmt::join(engine.containers, " | "))},
                    {"name", engine.name}});
  }
  return rows;
}

Json language_rows() {
  Json rows = Json::array();
  for (const Language& language : languages())
    rows.push_back({{"id", language.id}, {"written_by", language.written_by}, {"name", language.name}});
  return rows;
}

/// A registry that can be listed.
struct ListRow {
  std::string_view id;
  Json (*rows)();
};
constexpr std::array kLists = {
    ListRow{"techniques", technique_rows}, ListRow{"features", feature_rows},     ListRow{"maps", map_rows},
    ListRow{"surfaces", surface_rows},     ListRow{"metrics", metric_rows},       ListRow{"formats", format_rows},
    ListRow{"encodings", encoding_rows},   ListRow{"heightmaps", heightmap_rows}, ListRow{"views", view_rows},
    ListRow{"backends", backend_rows},     ListRow{"engines", engine_rows},       ListRow{"languages", language_rows},
};

std::string cell(const Json& value) {
  if (value.is_string()) return value.get<std::string>();
  return value.is_boolean() ? (value.get<bool>() ? "yes" : "no") : value.dump();
}

/// Objects of the same keys as a table with the keys as its head.
std::string table(const Json& rows, std::string_view indent, const Paint& paint) {
  std::vector<std::vector<std::string>> cells;
  for (const Json& row : rows) {
    if (cells.empty()) {
      cells.emplace_back();
      for (const auto& item : row.items()) cells.back().push_back(paint.dim(item.key()));
    }
    cells.emplace_back();
    for (const auto& item : row.items()) cells.back().push_back(cell(item.value()));
  }
  return columns(cells, indent);
}

void print_parameter(const Json& row, const Paint& paint) {
  const std::string condition = cell(row["active_if"]);
  put("  {}  {}\n", paint.bold(cell(row["id"])), cell(row["values"]));
  put("    {}; default {}{}{}\n", cell(row["description"]), cell(row["default"]),
      cell(row["stage"]) == "bake" ? "; baked" : "", condition.empty() ? "" : fmt::format("; if {}", condition));
}

/// Every technique that can have a feature lists its parameters as its own.
std::set<std::string_view> ids_of_features() {
  std::set<std::string_view> ids;
  for (const Feature& feature : all_features()) {
    ids.insert(feature.id);
    for (const FeatureRow& row : feature.rows)
      for (const Param& param : row.params) ids.insert(param.id);
  }
  return ids;
}

void print_techniques(const Json& rows, const Paint& paint) {
  const std::set<std::string_view> of_features = ids_of_features();
  for (const Json& row : rows) {
    put("{}  {}\n", paint.bold(cell(row["id"])), cell(row["description"]));
    const std::string note = cell(row["guarantee_note"]);
    put("  maps {}; guarantee {}{}{}; source {}\n", cell(row["maps"]), cell(row["guarantee"]), note.empty() ? "" : ": ",
        note, cell(row["source"]));
    std::vector<std::string> features;
    for (const Json& parameter : row["parameters"]) {
      const std::string id = cell(parameter["id"]);
      if (!of_features.contains(id)) print_parameter(parameter, paint);
      if (std::ranges::find(all_features(), id, &Feature::id) != all_features().end()) features.push_back(id);
    }
    put("  features (`list features`): {}\n\n", fmt::join(features, ", "));
  }
}

void print_features(const Paint& paint) {
  for (const Feature& feature : all_features()) {
    put("{}  {}\n", paint.bold(feature.id), feature.description);
    for (const FeatureRow& row : feature.rows) {
      put("  {}  {}\n", paint.bold(row.id), row.description);
      std::string more;
      for (const auto& [what, text] : {std::pair<std::string_view, std::string>{"parameters", parameter_ids(row)},
                                       {"brings", std::string(row.also)},
                                       {"guarantees hold", std::string(row.caveat)},
                                       {"source", std::string(row.source)}})
        if (!text.empty()) more += fmt::format("{}{} {}", more.empty() ? "" : "; ", what, text);
      if (!more.empty()) put("    {}\n", more);
    }
    put("\n");
  }
}

struct ListArguments {
  std::string what;
  bool json = false;
};

void list_command(const ListArguments& arguments) {
  const ListRow& list = find_row(kLists, "list", arguments.what);
  const Json rows = list.rows();
  const Paint paint = paint_for_stdout();
  if (arguments.json) {
    print_json(rows, 2);
  } else if (list.rows == technique_rows) {
    print_techniques(rows, paint);
  } else if (list.rows == feature_rows) {
    print_features(paint);
  } else {
    put("{}", table(rows, "", paint));
  }
}

}  // namespace

void add_list_command(CLI::App& app, Exit& /*exit_code*/) {
  CLI::App* command = app.add_subcommand("list", "techniques, maps, metrics and whatever else a config can name");
  const auto arguments = std::make_shared<ListArguments>();
  command->add_option("WHAT", arguments->what, fmt::format("{}", fmt::join(ids_of(kLists), " | ")))->required();
  add_json_option(*command, arguments->json);
  command->footer("Example:\n  reliefbench list techniques");
  command->callback([arguments] { list_command(*arguments); });
}

}  // namespace reliefbench
