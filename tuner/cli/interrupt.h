#pragma once

namespace reliefbench {

/// From now on kStopSignals do not end the process: long work asks is_interrupted(), and answers with what it has.
/// Those that are ignored stay so.
void heed_interrupts();
[[nodiscard]] bool is_interrupted();

}  // namespace reliefbench
