#pragma once
#include <vector>

#include "kernels/trace/technique.h"

namespace reliefbench {

/// What each technique is by itself: techniques() without what they share.
[[nodiscard]] std::vector<Technique> technique_rows();

}  // namespace reliefbench
