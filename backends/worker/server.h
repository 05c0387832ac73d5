#pragma once
#include "backends/worker/channel.h"
#include "backends/worker/shared_memory.h"

namespace reliefbench {

/// The worker's end: opens the device that the first request names, and does what is asked of it, until the host is
/// gone. throws: Error(environment): what came is no message
void serve(Channel& channel, SharedMemory& memory);

}  // namespace reliefbench
