#pragma once
#include <filesystem>
#include <string_view>

#include "kernels/base/error.h"

namespace reliefbench {

/// A file or folder that could not be read or written. It is never a case's own failure: the case loops let it pass.
class FileError : public Error {
 public:
  using Error::Error;
};

/// "PATH: WHAT: the system's words" with the exit code that the cause deserves: a full, broken or far-off disk,
/// and too few descriptors or memory, are the environment's; a path that is missing, forbidden or of another kind is
/// bad input. error_number: an errno
[[noreturn]] void fail_file(const std::filesystem::path& path, std::string_view what, int error_number);

}  // namespace reliefbench
