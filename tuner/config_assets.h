#pragma once
#include "kernels/embedded.h"

namespace reliefbench {

[[nodiscard]] const std::vector<EmbeddedFile>& embedded_configs();  ///< configs/extremes/* and configs/claims/*

}  // namespace reliefbench
