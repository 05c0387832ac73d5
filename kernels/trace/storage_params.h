#pragma once
#include <vector>

#include "kernels/trace/technique.h"

namespace reliefbench {

/// A map kind's own parameter as settings have it.
[[nodiscard]] Param map_param(const MapParam& param);

/// The parameters that the storage of a technique's map gives it, in StorageUse's order. maps: those it runs on
[[nodiscard]] std::vector<Param> storage_params(const std::vector<MapKind>& maps, const StorageUse& use);

}  // namespace reliefbench
