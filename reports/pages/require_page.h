#pragma once
#include <filesystem>

#include "tuner/measure/require_run.h"

namespace reliefbench {

inline constexpr const char* kSheetFile = "gallery.webp";

/// Writes require.json, require.html and the pictures that the answer rests on, images/<feature>-without.png, -with.png
/// and -reference.png, and all of them on one sheet, images/gallery.webp, into a folder. throws: FileError
void write_require(const RequireReport& report, const std::filesystem::path& folder);

}  // namespace reliefbench
