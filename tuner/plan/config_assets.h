#pragma once
#include "kernels/base/embedded.h"

namespace reliefbench {

[[nodiscard]] const std::vector<EmbeddedFile>& embedded_extremes();  ///< configs/extremes/*
[[nodiscard]] const std::vector<EmbeddedFile>& embedded_claims();    ///< configs/claims/*
[[nodiscard]] const std::vector<EmbeddedFile>& embedded_spaces();    ///< configs/exhaustive.json, configs/solids.json

}  // namespace reliefbench
