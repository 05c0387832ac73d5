#pragma once
#include <string_view>
#include <vector>

namespace reliefbench {

/// A text file that the binary carries (CMakeLists.txt, reliefbench_embed).
struct EmbeddedFile {
  std::string_view name;
  std::string_view text;
};

[[nodiscard]] const std::vector<EmbeddedFile>& embedded_shaders();  ///< kernels/shaders/*

/// throws: Error(environment) where there is no such file
[[nodiscard]] std::string_view embedded_text(const std::vector<EmbeddedFile>& files, std::string_view name);

}  // namespace reliefbench
