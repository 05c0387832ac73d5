#pragma once
#include "kernels/base/error.h"

namespace CLI {
class App;
}

namespace reliefbench {

// One function a subcommand, one file each. It adds the subcommand to `app`; when that one is chosen, its callback runs
// the command. `exit_code` is Exit::done before, and set where the command can end otherwise. Errors are thrown as
// Error and caught in main. Both arguments must outlive the parse.
void add_devices_command(CLI::App& app, Exit& exit_code);
void add_list_command(CLI::App& app, Exit& exit_code);
void add_sweep_command(CLI::App& app, Exit& exit_code);
void add_merge_command(CLI::App& app, Exit& exit_code);
void add_recommend_command(CLI::App& app, Exit& exit_code);
void add_compare_command(CLI::App& app, Exit& exit_code);
void add_choose_command(CLI::App& app, Exit& exit_code);
void add_stress_command(CLI::App& app, Exit& exit_code);
void add_claims_command(CLI::App& app, Exit& exit_code);
void add_report_command(CLI::App& app, Exit& exit_code);
void add_presets_command(CLI::App& app, Exit& exit_code);
void add_export_command(CLI::App& app, Exit& exit_code);
void add_view_command(CLI::App& app, Exit& exit_code);
void add_tuners_command(CLI::App& app, Exit& exit_code);
void add_bake_command(CLI::App& app, Exit& exit_code);
void add_tune_command(CLI::App& app, Exit& exit_code);
void add_require_command(CLI::App& app, Exit& exit_code);
void add_track_command(CLI::App& app, Exit& exit_code);

}  // namespace reliefbench
