#pragma once
#include "kernels/base/embedded.h"

namespace reliefbench {

[[nodiscard]] const std::vector<EmbeddedFile>& embedded_assets();  ///< reports/assets/* and Chart.js

}  // namespace reliefbench
