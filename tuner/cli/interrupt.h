#pragma once

namespace reliefbench {

/// From now on SIGINT and SIGTERM do not end the process: long work asks is_interrupted(), and answers with what it
/// has.
void heed_interrupts();
[[nodiscard]] bool is_interrupted();

}  // namespace reliefbench
