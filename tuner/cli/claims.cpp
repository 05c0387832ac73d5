#include "tuner/measure/claims.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "backends/worker/remote.h"
#include "kernels/base/error.h"
#include "tuner/cli/commands.h"
#include "tuner/cli/format.h"
#include "tuner/cli/interrupt.h"
#include "tuner/cli/options.h"
#include "tuner/measure/sweep.h"
#include "tuner/plan/plan.h"
#include "tuner/results/statistics.h"

namespace reliefbench {
namespace {

struct ClaimsArguments {
  std::string backend = "all";
  int device = 0;
  std::string filter;
  std::optional<Size> frame_px;
  bool quick = false;
  bool quiet = false;
  bool json = false;
};

std::string figure(const std::map<std::string, double>& figures, const std::string& metric) {
  const auto found = figures.find(metric);
  return found == figures.end() ? "" : format_number(found->second);
}

std::string painted(ClaimVerdict verdict, const Paint& paint) {
  const std::string_view text = claim_verdict_id(verdict);
  if (verdict == ClaimVerdict::not_testable || verdict == ClaimVerdict::throttled) return paint.dim(text);
  return verdict == ClaimVerdict::reproduced ? paint.good(text) : paint.bad(text);
}

void print_rows(const ClaimResult& result, const Paint& paint) {
  const Claim& claim = *result.claim;
  const auto has_paper = [&](const std::string& metric) {
    return std::ranges::any_of(claim.rows, [&](const ClaimRow& row) { return row.paper.contains(metric); });
  };
  std::vector<std::vector<std::string>> rows{{""}};
  for (const std::string& metric : claim.metrics) {
    rows[0].push_back(
        paint.dim(fmt::format("{}{}", metric, result.is_software && metric.ends_with("_time") ? " *" : "")));
    if (has_paper(metric)) rows[0].push_back(paint.dim("paper"));
  }
  for (std::size_t i = 0; i < claim.rows.size(); ++i) {
    std::vector<std::string> row{claim.rows[i].label};
    for (const std::string& metric : claim.metrics) {
      row.push_back(figure(result.scenes.front().rows[i].values, metric));
      if (has_paper(metric)) row.push_back(figure(claim.rows[i].paper, metric));
    }
    rows.push_back(std::move(row));
  }
  put("{}", columns(rows, "  "));
}

/// Each setting that is beaten, and under it a line a scene: how many times as fast is which.
void print_duels(std::vector<ClaimDuel> duels, const Paint& paint) {
  if (duels.empty()) return;
  std::ranges::stable_sort(duels, {}, &ClaimDuel::of);
  std::vector<std::vector<std::string>> lines;
  std::string_view last;
  for (const ClaimDuel& duel : duels) {
    if (duel.of != last) lines.push_back({paint.bold(duel.of)});
    last = duel.of;
    lines.push_back({"  " + duel.scene, times_text(duel.times_as_fast), duel.by});
  }
  put("  times as fast [{}], and what is\n{}", coverage_text(duels.front().times_as_fast.n), columns(lines, "  "));
}

/// What a claim was drawn of, and how large.
std::string drawn(const ClaimResult& result) {
  if (result.scenes.empty()) return "of no scene";
  const SceneFigures& first = result.scenes.front();
  const std::string frame = fmt::format("{}x{}", first.scene->scene.width_px, first.scene->scene.height_px);
  if (result.scenes.size() > 1) return fmt::format("{} scenes at {} px", result.scenes.size(), frame);
  return fmt::format("{} of {}x{} texels at {} px", first.scene->id, first.map_px.width, first.map_px.height, frame);
}

void print_result(const ClaimResult& result, const Paint& paint) {
  const Claim& claim = *result.claim;
  const std::size_t count = result.scenes.size();
  put("{}  {} on {}, {} ({})\n{}\n", paint.bold(claim.id), claim.source, result.backend, drawn(result), result.device,
      claim.about);
  if (!result.missing.empty()) put("Left out: {}; `./dev setup` fetches them\n", fmt::join(result.missing, ", "));
  if (result.undone > 0)
    put("interrupted: {} of {} scenes were not drawn; the answer so far\n", result.undone,
        result.undone + static_cast<int>(count));
  if (count == 1 && result.scenes.front().failure.empty()) print_rows(result, paint);
  for (std::size_t i = 0; i < claim.checks.size(); ++i) {
    const ClaimCheck& check = claim.checks[i];
    const ClaimAnswer& answer = result.answers[i];
    if (!answer.table.empty()) put("{}", columns(answer.table, "  "));
    if (check.by_factor > 0) print_duels(answer.duels, paint);
    put("  {}: {}\n    {}\n", painted(answer.verdict, paint), check.says, answer.numbers);
    if (check.of.empty()) continue;
    if (const std::string& source = claim.rows[claim.row_index(check.of)].source; !source.empty())
      put("    {}\n", paint.dim("its source: " + source));
  }
  put("\n");
}

Exit claims_command(const ClaimsArguments& arguments) {
  std::vector<Claim> claims = built_in_claims();
  std::erase_if(claims, [&](const Claim& claim) {
    return !arguments.filter.empty() && !glob_matches(arguments.filter, claim.id);
  });
  if (claims.empty()) fail_input("claims: the filter '{}' matches none", arguments.filter);
  const std::vector<std::string> backend_ids = choose_backends(arguments.backend);
  const std::vector<DeviceInfo> devices =
      arguments.quick ? std::vector<DeviceInfo>() : chosen_devices(backend_ids, arguments.device);
  const std::string why = set_sizes(claims, devices, arguments.frame_px);
  if (!why.empty() && !arguments.json) put("{}\n\n", why);
  heed_interrupts();
  const std::vector<ClaimResult> results = run_claims(claims, {.backends = backend_ids,
                                                               .device = arguments.device,
                                                               .quiet = arguments.quiet,
                                                               .open = open_isolated,
                                                               .is_interrupted = is_interrupted});
  if (arguments.json) {
    print_json(claims_json(results), 1);
  } else {
    const Paint paint = paint_for_stdout();
    bool has_software = false;
    for (const ClaimResult& result : results) {
      print_result(result, paint);
      has_software |= result.is_software;
    }
    if (has_software) put("* ms on a software rasteriser: no paper's figure of a GPU is tested by them\n");
  }
  const bool is_whole = std::ranges::all_of(results, [](const ClaimResult& result) { return result.undone == 0; });
  return is_whole ? Exit::done : Exit::inconclusive;
}

}  // namespace

void add_claims_command(CLI::App& app, Exit& exit_code) {
  CLI::App* command =
      app.add_subcommand("claims", "the papers' tables re-run: their figures beside ours, a verdict each");
  const auto arguments = std::make_shared<ClaimsArguments>();
  command->add_option("--backend", arguments->backend, "opengl | vulkan | all")->capture_default_str();
  add_device_option(*command, arguments->device);
  command->add_option("--filter", arguments->filter, "only claims whose id matches this glob, e.g. 'bvbv24*'");
  add_frame_option(*command, arguments->frame_px, "1080p on hardware, the claims' own on software rasterisers");
  command->add_flag("--quick", arguments->quick, "the claims' own small frames and heightmaps on hardware, too");
  add_quiet_option(*command, arguments->quiet);
  add_json_option(*command, arguments->json);
  command->footer(
      "Hardware draws at 1080p, procedural heightmaps of 512x512 at least; bake_time is of its GPU bakers, by its own\n"
      "clock, without upload and read-back. Software rasterisers draw the claims' own small sizes; bake_time then is\n"
      "of one thread of the processor.\n"
      "Ctrl-C, SIGTERM and SIGHUP (a closed terminal) end it with the answer of the scenes that were drawn.\n"
      "Example:\n  reliefbench claims --backend vulkan");
  command->callback([arguments, &exit_code] { exit_code = claims_command(*arguments); });
}

}  // namespace reliefbench
