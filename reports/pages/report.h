#pragma once
#include <filesystem>
#include <span>
#include <string>

#include "tuner/results/store.h"

namespace reliefbench {

/// One HTML file that needs nothing else: styles, scripts, data and pictures are in it, and its content security
/// policy forbids the browser to load anything. Several runs are laid over one another by device.
/// stress: folder of `reliefbench stress`, whose matrix becomes a section; empty: none
/// throws: Error(nothing_measured): the runs have no records; Error(bad_input): a metric or budget that is unknown; as
/// load_stress
[[nodiscard]] std::string make_report(std::span<const Run> runs, const std::filesystem::path& stress = {});

/// Reads run folders and writes their report, whole or not at all.
/// throws: Error(bad_input): not a run, unwritable; as make_report
void write_report(std::span<const std::filesystem::path> folders, const std::filesystem::path& output,
                  const std::filesystem::path& stress = {});

}  // namespace reliefbench
