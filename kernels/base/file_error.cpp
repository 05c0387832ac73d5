#include "kernels/base/file_error.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>

namespace reliefbench {
namespace {

constexpr std::array kOfTheMachine = {ENOSPC, EDQUOT, EFBIG, EIO,    EMFILE,   ENFILE,
                                      ENOMEM, ENOLCK, EINTR, ESTALE, ETIMEDOUT};

}  // namespace

void fail_file(const std::filesystem::path& path, std::string_view what, int error_number) {
  const bool is_machine = std::ranges::find(kOfTheMachine, error_number) != kOfTheMachine.end();
  throw FileError(is_machine ? Exit::environment : Exit::bad_input,
                  fmt::format("{}: {}: {}", path.string(), what, std::generic_category().message(error_number)));
}

}  // namespace reliefbench
