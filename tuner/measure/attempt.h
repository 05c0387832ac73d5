#pragma once
#include <functional>
#include <string>

#include "tuner/measure/session.h"

namespace reliefbench {

/// Does `work`, which draws, and where the device is lost over it opens that again and does it once more.
/// release: gives up whatever is on the device; called before it is opened again
/// returns: why it can't be drawn, "crashed: signal 11"; "" where it was
/// throws: Error(bad_input), FileError: those of `work`; Error(environment): the device does not come back
[[nodiscard]] std::string attempt(
    Session& session, const std::function<void()>& work, const std::function<void()>& release = [] {});

}  // namespace reliefbench
