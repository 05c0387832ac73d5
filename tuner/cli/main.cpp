#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "kernels/base/error.h"
#include "tuner/cli/commands.h"
#include "tuner/results/host.h"

// NOLINTNEXTLINE(bugprone-exception-escape): a message that stderr does not take ends the process all the same
int main(int argc, char** argv) {
  using namespace reliefbench;
  CLI::App app{"reliefbench: measure and tune per-pixel displacement mapping"};
  app.footer(
      "Start with:\n  reliefbench sweep configs/quickstart.json -o out/quickstart\n"
      "  reliefbench recommend out/quickstart");
  app.set_version_flag("--version", fmt::format("reliefbench {} ({})", version(), git_sha()));
  app.require_subcommand(1);
  int exit_code = 0;
  add_sweep_command(app, exit_code);
  add_recommend_command(app, exit_code);
  add_tune_command(app, exit_code);
  add_report_command(app, exit_code);
  add_compare_command(app, exit_code);
  add_stress_command(app, exit_code);
  add_claims_command(app, exit_code);
  add_presets_command(app, exit_code);
  add_export_command(app, exit_code);
  add_view_command(app, exit_code);
  add_tuners_command(app, exit_code);
  add_bake_command(app, exit_code);
  add_list_command(app, exit_code);
  add_devices_command(app, exit_code);
  try {
    const auto named = [&](const CLI::App* command) { return argc > 1 && command->check_name(argv[1]); };
    if (argc > 1 && argv[1][0] != '-' && app.get_subcommands(named).empty())
      fail_input("unknown command '{}' (see --help)", argv[1]);
    app.parse(argc, argv);
    return exit_code;
  } catch (const CLI::Success& asked) {  // --help, --version
    return app.exit(asked);
  } catch (const CLI::ParseError& error) {
    fmt::print(stderr, "reliefbench: {} (see --help)\n", error.what());
    return static_cast<int>(Exit::bad_input);
  } catch (const Error& error) {
    fmt::print(stderr, "reliefbench: {}\n", error.what());
    return static_cast<int>(error.code());
  } catch (const std::exception& error) {
    fmt::print(stderr, "reliefbench: {}\n", error.what());
    return static_cast<int>(Exit::environment);
  }
}
