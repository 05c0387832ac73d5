#include "kernels/base/embedded.h"

#include "kernels/base/error.h"

namespace reliefbench {

std::string_view embedded_text(const std::vector<EmbeddedFile>& files, std::string_view name) {
  for (const EmbeddedFile& file : files)
    if (file.name == name) return file.text;
  fail_environment("the binary carries no file '{}'", name);
}

}  // namespace reliefbench
