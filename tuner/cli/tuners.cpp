#include "tuner/tune/tuners.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "reports/pages/tuners_page.h"
#include "tuner/cli/commands.h"
#include "tuner/cli/format.h"
#include "tuner/cli/options.h"
#include "tuner/measure/progress.h"
#include "tuner/results/recorded_run.h"

namespace reliefbench {
namespace {

struct TunersArguments {
  std::string path;
  RecordedQuery query;
  int seeds = 20;
  double part = 1;
  std::optional<int> certificates;  ///< none: as many as seeds
  double correlation = 0;
  std::vector<double> shares;
  std::string output;
  bool quiet = false;
  bool json = false;
};

std::string share_text(double ratio) { return fmt::format("{} %", format_number(100 * ratio)); }

/// "mean / 95 % of the seeds / worst"
std::string spread_text(const Spread& figure, int digits, double unit = 1) {
  const auto text = [&](double value) {
    return std::isinf(value) ? "none" : fmt::format("{:.{}f}", value / unit, digits);
  };
  return fmt::format("{} / {} / {}", text(figure.mean), text(figure.most), text(figure.worst));
}
std::string percents_text(const Spread& figure) { return spread_text(figure, 2, 0.01); }

void print_line(const TunerLine& line, const Paint& paint) {
  put("\n{}  {}\n", paint.bold(line.strategy), paint.dim(line.description));
  std::vector<std::vector<std::string>> rows = {
      {"share", "settings", "frames", "worst regret, %", "mean regret, %", "hypervolume", "false front, %"}};
  for (const TunerPoint& point : line.points)
    rows.push_back({point.share < 1 ? share_text(point.share) : "to its end", fmt::format("{:.0f}", point.timed.mean),
                    fmt::format("{:.0f}", point.samples.mean), percents_text(point.worst_regret),
                    percents_text(point.mean_regret), spread_text(point.hypervolume, 4),
                    percents_text(point.false_front)});
  put("{}", columns(rows, "  "));
}

void print_certificate(const CertificateCheck& check, double correlation) {
  if (check.seeds == 0) return;
  put("\ncertificate of `tune`, {} at {} confidence: held in {} of {} seeds ({} certified)\n",
      share_text(check.epsilon), share_text(check.confidence), check.held, check.seeds, check.certified);
  put("  frames a setting {}, worst regret {} %, frames of a round correlated by {}\n",
      spread_text(check.frames_per_setting, 2), percents_text(check.worst_regret), format_number(correlation));
}

void print_comparison(const TunerComparison& comparison) {
  const Paint paint = paint_for_stdout();
  put("{}\n", paint.bold(fmt::format("{}, {}, {}", comparison.scene, comparison.backend, comparison.device)));
  put("{} settings, {} feasible ({}), {} on the front of {}\n", comparison.settings, comparison.feasible,
      comparison.constraints.empty() ? "no constraint" : fmt::format("{}", fmt::join(comparison.constraints, ", ")),
      comparison.on_front, comparison.error_metric);
  if (comparison.part < 1) put("each seed searches {} of the settings, drawn at random\n", share_text(comparison.part));
  put("{}\n", paint.dim(fmt::format("Figures: mean over {} seeds / what {} of them keep / the worst. Regret \"none\": "
                                    "some error budget is left without an answer.",
                                    comparison.seeds, share_text(kMostSeeds))));
  for (const TunerLine& line : comparison.lines) print_line(line, paint);
  print_certificate(comparison.certificate, comparison.correlation);
}

void tuners_command(const TunersArguments& arguments) {
  const RecordedTable table = load_recorded(arguments.path, arguments.query);
  Progress progress(arguments.quiet);
  TunersOptions options{.seeds = arguments.seeds,
                        .part = arguments.part,
                        .certificates = arguments.certificates.value_or(arguments.seeds),
                        .correlation = arguments.correlation};
  if (!arguments.shares.empty()) options.shares = arguments.shares;
  options.on_progress = [&](double fraction) {
    progress.update(fraction, fmt::format("{} seeds on {} settings", arguments.seeds, table.samples.size()));
  };
  const TunerComparison comparison = compare_tuners(table, options);
  progress.finish();
  if (!arguments.output.empty()) write_tuners_page(comparison, arguments.output);
  if (arguments.json) {
    print_json(tuners_json(comparison), 2);
    return;
  }
  print_comparison(comparison);
  if (!arguments.output.empty()) put("\nwritten: {}\n", arguments.output);
}

}  // namespace

void add_tuners_command(CLI::App& app, Exit& /*exit_code*/) {
  CLI::App* command = app.add_subcommand("tuners", "search strategies compared on a recorded sweep");
  const auto arguments = std::make_shared<TunersArguments>();
  RecordedQuery& query = arguments->query;
  command->add_option("RUN", arguments->path, "a finished sweep: its folder or its table.csv")->required();
  command->add_option("--backend", query.backend, "of several in the run, this one")->type_name("ID");
  command->add_option("--scene", query.scene, "likewise")->type_name("ID");
  command->add_option("--error", query.error_metric, "metric of the error; default: the run's")->type_name("METRIC");
  add_bounds_option(*command, "--constraint", query.constraints,
                    "bound that every setting keeps; may be repeated; default: the run's");
  command->add_option("--seeds", arguments->seeds, "how often each strategy is run; default 20")
      ->check(CLI::Range(1, 10000));
  command->add_option("--part", arguments->part, "of the settings that a seed searches, drawn anew for each; default 1")
      ->check(CLI::Range(1e-9, 1.0));
  command
      ->add_option("--certificates", arguments->certificates,
                   "seeds on which `tune` runs to its certificate; default: as many")
      ->check(CLI::Range(0, 10000));
  command
      ->add_option("--correlation", arguments->correlation,
                   "of the frames of a round while `tune` runs to its certificate; default 0")
      ->check(CLI::Range(0.0, 1.0));
  take_each(command->add_option("--share", arguments->shares,
                                "of the settings that may be timed, 1: until it ends; may be repeated"))
      ->check(CLI::Range(1e-9, 1.0));
  command->add_option("-o,--output", arguments->output, "also as an HTML page")->type_name("FILE");
  add_quiet_option(*command, arguments->quiet);
  add_json_option(*command, arguments->json);
  command->footer(
      "No device is needed: times are drawn from the recorded samples, and answers judged by their true medians.\n"
      "Example:\n"
      "  reliefbench tuners out/quickstart --backend opengl --scene rocks/grazing -o tuners.html\n"
      "  reliefbench tuners out/exhaustive --part 0.8 --seeds 30 --share 0.05");
  command->callback([arguments] { tuners_command(*arguments); });
}

}  // namespace reliefbench
