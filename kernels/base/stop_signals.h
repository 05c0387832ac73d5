#pragma once
#include <array>
#include <csignal>

namespace reliefbench {

/// What asks a process to stop: Ctrl-C, a batch system, and a terminal that was closed. Who heeds them leaves those
/// alone that are ignored: nohup lets a process outlive its terminal, and a shell its background jobs Ctrl-C.
inline constexpr std::array kStopSignals{SIGINT, SIGTERM, SIGHUP};

}  // namespace reliefbench
