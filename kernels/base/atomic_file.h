#pragma once
#include <filesystem>
#include <string_view>

namespace reliefbench {

/// Writes a file whole or not at all: temporary file beside it, fsync, rename. throws: Error(bad_input): unwritable
void write_atomically(const std::filesystem::path& path, std::string_view bytes);

}  // namespace reliefbench
