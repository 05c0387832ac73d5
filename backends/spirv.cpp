#include "backends/spirv.h"

#include <map>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

// The SPIR-V specification: 2.3 physical layout, 3.20 decorations, 3.52 instructions.
constexpr std::uint32_t kMagic = 0x07230203;
constexpr std::size_t kHeaderWords = 5;
constexpr std::uint32_t kOpName = 5;
constexpr std::uint32_t kOpDecorate = 71;
constexpr std::uint32_t kOpFunctionEnd = 56;
constexpr std::uint32_t kSpecId = 1;

/// A literal string: UTF-8, first byte lowest, ended by a zero.
std::string literal(std::span<const std::uint32_t> words) {
  std::string text;
  for (const std::uint32_t word : words)
    for (unsigned shift = 0; shift < 32; shift += 8) {
      const char c = static_cast<char>((word >> shift) & 0xffU);
      if (c == '\0') return text;
      text += c;
    }
  return text;
}

}  // namespace

std::vector<DeclaredConstant> declared_constants(std::span<const std::uint32_t> spirv) {
  if (spirv.size() < kHeaderWords || spirv[0] != kMagic) fail_environment("not a SPIR-V module");
  std::map<std::uint32_t, std::string> names;  // by result id; names come before decorations
  std::vector<DeclaredConstant> constants;
  std::uint32_t opcode = 0;
  for (std::size_t at = kHeaderWords; at < spirv.size();) {
    const std::size_t length = spirv[at] >> 16U;
    if (length == 0 || length > spirv.size() - at) fail_environment("SPIR-V module broken at word {}", at);
    const std::span<const std::uint32_t> operands = spirv.subspan(at + 1, length - 1);
    opcode = spirv[at] & 0xffffU;
    if (opcode == kOpName && operands.size() >= 2) names[operands[0]] = literal(operands.subspan(1));
    if (opcode == kOpDecorate && operands.size() >= 3 && operands[1] == kSpecId)
      constants.push_back({.id = operands[2], .name = names[operands[0]]});
    at += length;
  }
  // Every shader ends with its last function. Drivers crash on less (Mesa 22.3.6).
  if (opcode != kOpFunctionEnd) fail_environment("SPIR-V module cut short");
  return constants;
}

}  // namespace reliefbench
