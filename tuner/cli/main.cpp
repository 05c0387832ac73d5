#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <new>
#include <optional>
#include <system_error>

#include "backends/worker/worker.h"
#include "kernels/base/console.h"
#include "kernels/base/error.h"
#include "kernels/base/memory.h"
#include "tuner/cli/commands.h"
#include "tuner/cli/format.h"
#include "tuner/results/host.h"

namespace reliefbench {
namespace {

// Libraries and drivers end the process in their own ways where a file cannot be opened.
constexpr rlim_t kLeastDescriptors = 64;

void check_descriptors() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) == 0 && limit.rlim_cur < kLeastDescriptors)
    fail_environment("{} files may be open at a time (ulimit -n): at least {} are needed", limit.rlim_cur,
                     kLeastDescriptors);
}

/// Help whose lines fit the terminal: an option's words go on under where they began.
class FittedHelp : public CLI::Formatter {
 public:
  [[nodiscard]] std::string make_option(const CLI::Option* option, bool is_positional) const override {
    return fitted_entry(CLI::Formatter::make_option(option, is_positional));
  }
  [[nodiscard]] std::string make_subcommand(const CLI::App* command) const override {
    return fitted_entry(CLI::Formatter::make_subcommand(command));
  }

 private:
  /// A name that reaches into the words' column has a line of its own.
  [[nodiscard]] std::string fitted_entry(std::string_view entry) const {
    const std::size_t words = entry.find('\n') + 1;
    if (words == 0 || words == entry.size()) return fitted(entry, line_width(), "", get_column_width() - 2);
    return fitted(entry.substr(0, words), line_width()) + fitted(entry.substr(words), line_width(), "", 0);
  }
};

Exit run(int argc, char** argv) {
  check_descriptors();
  CLI::App app{"reliefbench: measure and tune per-pixel displacement mapping"};
  app.formatter(std::make_shared<FittedHelp>());  // before the commands, which inherit it
  app.footer(
      "Start with:\n  reliefbench sweep configs/quickstart.json -o out/quickstart\n"
      "  reliefbench recommend out/quickstart\n"
      "Drivers run in processes of their own; RELIEFBENCH_IN_PROCESS=1 keeps them in this one, for debuggers.");
  app.set_version_flag("--version", fmt::format("reliefbench {} ({})", version(), git_sha()));
  app.require_subcommand(1);
  Exit exit_code = Exit::done;
  add_sweep_command(app, exit_code);
  add_merge_command(app, exit_code);
  add_recommend_command(app, exit_code);
  add_tune_command(app, exit_code);
  add_require_command(app, exit_code);
  add_report_command(app, exit_code);
  add_compare_command(app, exit_code);
  add_choose_command(app, exit_code);
  add_track_command(app, exit_code);
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
    app.exit(asked);
    return Exit::done;
  } catch (const CLI::ParseError& error) {
    print_error(fmt::format("{} (see --help)", error.what()));
    return Exit::bad_input;
  }
}

/// What no part of the program answers for. A library's words come without its marks:
/// "[json.exception.type_error.302]".
std::string unforeseen(const std::exception& error) {
  const std::string_view what = error.what();
  const std::size_t mark = what.starts_with('[') ? what.find("] ") : std::string_view::npos;
  return std::string(mark == std::string_view::npos ? what : what.substr(mark + 2));
}

Exit run_and_tell(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const Error& error) {
    print_error(error.what());
    return error.code();
  } catch (const std::bad_alloc&) {
    print_error("out of memory");
  } catch (const std::exception& error) {
    if (std::ferror(stdout) == 0) print_error(unforeseen(error));  // else main() tells it
  }
  return Exit::environment;
}

}  // namespace
}  // namespace reliefbench

int main(int argc, char** argv) {
  reliefbench::keep_freed_memory();
  std::signal(SIGXFSZ, SIG_IGN);  // a file over its size limit then fails as one on a full disk
  if (const std::optional<int> status = reliefbench::run_worker(argc, argv)) return *status;
  reliefbench::Exit exit_code = reliefbench::run_and_tell(argc, argv);
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
    reliefbench::print_error("standard output cannot be written: " + std::generic_category().message(errno));
    exit_code = reliefbench::Exit::environment;
  }
  return static_cast<int>(exit_code);
}
