#include "tuner/cli/interrupt.h"

#include <atomic>
#include <csignal>

#include "kernels/base/stop_signals.h"

namespace reliefbench {
namespace {

std::atomic<bool> interrupted = false;
static_assert(std::atomic<bool>::is_always_lock_free, "else a handler may not set it");
extern "C" void on_interrupt(int) { interrupted = true; }

}  // namespace

void heed_interrupts() {
  for (const int signal : kStopSignals) {
    struct sigaction now {};
    if (::sigaction(signal, nullptr, &now) == 0 && now.sa_handler != SIG_IGN) std::signal(signal, on_interrupt);
  }
}

bool is_interrupted() { return interrupted; }

}  // namespace reliefbench
