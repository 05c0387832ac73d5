#include "backends/spirv.h"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

// The SPIR-V specification: 2.3 physical layout, 3.7 storage classes, 3.20 decorations, 3.52 instructions.
constexpr std::size_t kHeaderWords = 5;
enum Opcode : std::uint32_t {
  kOpName = 5,
  kOpExecutionMode = 16,
  kOpTypeVector = 23,
  kOpTypeImage = 25,
  kOpTypePointer = 32,
  kOpFunction = 54,
  kOpFunctionEnd = 56,
  kOpFunctionCall = 57,
  kOpVariable = 59,
  kOpLoad = 61,
  kOpAccessChain = 65,
  kOpInBoundsAccessChain = 66,
  kOpDecorate = 71,
  kOpFMod = 141,
};
enum Decoration : std::uint32_t { kSpecId = 1, kBlock = 2, kLocation = 30, kBinding = 33, kDescriptorSet = 34 };
constexpr std::uint32_t kLocalSize = 17;  // the execution mode
enum StorageClass : std::uint32_t { kUniformConstant = 0, kUniform = 2, kOutput = 3 };

using Words = std::span<const std::uint32_t>;

/// A literal string: UTF-8, first byte lowest, ended by a zero.
std::string literal(Words words) {
  std::string text;
  for (const std::uint32_t word : words)
    for (unsigned shift = 0; shift < 32; shift += 8) {
      const char c = static_cast<char>((word >> shift) & 0xffU);
      if (c == '\0') return text;
      text += c;
    }
  return text;
}

struct Variable {
  std::uint32_t id;
  std::uint32_t pointer_type;
  std::uint32_t storage;
};

/// What a pass over the instructions finds. Everything is keyed by result id.
struct Module {
  std::map<std::uint32_t, std::string> names;
  std::map<std::uint32_t, std::uint32_t> pointees;  ///< of pointer types
  std::map<std::uint32_t, std::map<std::uint32_t, std::uint32_t>> decorations;
  std::set<std::uint32_t> images;  ///< types of images without a sampler
  std::array<std::uint32_t, 3> group{};
  std::vector<std::uint32_t> constants;  ///< in the module's order
  std::vector<Variable> variables;
  std::set<std::uint32_t> read;  ///< what functions load from, index or hand on
  bool is_in_functions = false;

  void take(std::uint32_t opcode, Words operands);
  [[nodiscard]] std::string name_of(std::uint32_t id) const {
    const auto found = names.find(id);
    return found == names.end() ? "" : found->second;
  }
  [[nodiscard]] std::optional<std::uint32_t> decoration(std::uint32_t id, Decoration kind) const {
    const auto found = decorations.find(id);
    if (found == decorations.end() || !found->second.contains(kind)) return std::nullopt;
    return found->second.at(kind);
  }
};

void Module::take(std::uint32_t opcode, Words operands) {
  const std::size_t count = operands.size();
  if (opcode == kOpName && count >= 2) names[operands[0]] = literal(operands.subspan(1));
  if (opcode == kOpTypeImage && count >= 1) images.insert(operands[0]);
  if (opcode == kOpExecutionMode && count >= 5 && operands[1] == kLocalSize)
    std::ranges::copy(operands.subspan(2, 3), group.begin());
  if (opcode == kOpTypePointer && count >= 3) pointees[operands[0]] = operands[2];
  if (opcode == kOpDecorate && count >= 2) {
    decorations[operands[0]][operands[1]] = count >= 3 ? operands[2] : 0;
    if (operands[1] == kSpecId && count >= 3) constants.push_back(operands[0]);
  }
  if (opcode == kOpFunction) is_in_functions = true;
  if (opcode == kOpVariable && count >= 3 && !is_in_functions)
    variables.push_back({.id = operands[1], .pointer_type = operands[0], .storage = operands[2]});
  if (is_in_functions && count >= 3) {
    if (opcode == kOpLoad || opcode == kOpAccessChain || opcode == kOpInBoundsAccessChain) read.insert(operands[2]);
    if (opcode == kOpFunctionCall) read.insert(operands.begin() + 3, operands.end());
  }
}

Module parse(Words spirv) {
  if (spirv.size() < kHeaderWords || spirv[0] != kSpirvMagic) fail_environment("not a SPIR-V module");
  Module module;
  std::uint32_t opcode = 0;
  for (std::size_t at = kHeaderWords; at < spirv.size();) {
    const std::size_t length = spirv[at] >> 16U;
    if (length == 0 || length > spirv.size() - at) fail_environment("SPIR-V module broken at word {}", at);
    opcode = spirv[at] & 0xffffU;
    module.take(opcode, spirv.subspan(at + 1, length - 1));
    at += length;
  }
  // Every shader ends with its last function. Drivers crash on less (Mesa 22.3.6).
  if (opcode != kOpFunctionEnd) fail_environment("SPIR-V module cut short");
  return module;
}

void sort_by_place(std::vector<ShaderVariable>& list) { std::ranges::sort(list, {}, &ShaderVariable::place); }

/// Adds what is not there yet.
void join(std::vector<ShaderVariable>& list, const std::vector<ShaderVariable>& more) {
  for (const ShaderVariable& variable : more)
    if (std::ranges::find(list, variable) == list.end()) list.push_back(variable);
  sort_by_place(list);
}

void check_places(const ShaderInterface& interface) {
  std::map<std::uint32_t, std::string> by_place;
  for (const auto* list : {&interface.samplers, &interface.uniform_blocks})
    for (const ShaderVariable& variable : *list) {
      const auto [there, is_new] = by_place.emplace(variable.place, variable.name);
      if (!is_new)
        fail_environment("SPIR-V: `{}` and `{}` are both at binding {}", there->second, variable.name, variable.place);
    }
}

}  // namespace

ShaderInterface reflect(std::span<const std::uint32_t> spirv) {
  const Module module = parse(spirv);
  ShaderInterface interface;
  interface.group = module.group;
  for (const std::uint32_t id : module.constants)
    interface.constants.push_back({.id = *module.decoration(id, kSpecId), .name = module.name_of(id)});
  for (const Variable& variable : module.variables) {
    if (variable.storage == kOutput) {
      if (const auto location = module.decoration(variable.id, kLocation))
        interface.outputs.push_back({.name = module.name_of(variable.id), .place = *location});
      continue;
    }
    const auto pointee = module.pointees.find(variable.pointer_type);
    if (pointee == module.pointees.end()) fail_environment("SPIR-V: variable {} has no pointer type", variable.id);
    const bool is_image = variable.storage == kUniformConstant && module.images.contains(pointee->second);
    const bool is_sampler = variable.storage == kUniformConstant && !is_image;
    const bool is_block = variable.storage == kUniform && module.decoration(pointee->second, kBlock);
    const auto binding = module.decoration(variable.id, kBinding);
    if ((!is_sampler && !is_image && !is_block) || !binding || !module.read.contains(variable.id)) continue;
    const std::string name = module.name_of(is_block ? pointee->second : variable.id);
    if (const auto set = module.decoration(variable.id, kDescriptorSet); set.value_or(0) != 0)
      fail_environment("SPIR-V: `{}` is in descriptor set {}, not in 0", name, *set);
    auto& list = is_image ? interface.images : (is_sampler ? interface.samplers : interface.uniform_blocks);
    list.push_back({.name = name, .place = *binding});
  }
  for (auto* list : {&interface.samplers, &interface.uniform_blocks, &interface.outputs, &interface.images})
    sort_by_place(*list);
  check_places(interface);
  return interface;
}

std::vector<BufferView> buffer_views(std::span<const std::uint32_t> spirv, int count) {
  std::vector<BufferView> views(static_cast<std::size_t>(count), BufferView::storage);
  const auto see = [&](const std::vector<ShaderVariable>& variables, BufferView view) {
    for (const auto& [name, place] : variables) {
      if (place >= views.size()) fail_environment("SPIR-V: `{}` is at binding {}, of {}", name, place, count);
      views[place] = view;
    }
  };
  const ShaderInterface shader = reflect(spirv);
  see(shader.uniform_blocks, BufferView::block);
  see(shader.samplers, BufferView::texels);
  return views;
}

std::vector<std::uint32_t> with_plain_names(Words spirv) {
  std::vector<std::uint32_t> plain(spirv.begin(), spirv.begin() + kHeaderWords);
  for (std::size_t at = kHeaderWords; at < spirv.size();) {
    const std::size_t count = std::clamp<std::size_t>(spirv[at] >> 16, 1, spirv.size() - at);
    const Words words = spirv.subspan(at, count);
    at += count;
    if ((words[0] & 0xffffU) != kOpName || count < 3) {
      plain.insert(plain.end(), words.begin(), words.end());
      continue;
    }
    std::string name = literal(words.subspan(2));
    name.resize(std::min(name.find('('), name.size()));
    const std::size_t name_words = name.size() / 4 + 1;  // with the zero at its end
    plain.push_back(static_cast<std::uint32_t>(name_words + 2) << 16 | kOpName);
    plain.push_back(words[1]);
    for (std::size_t i = 0; i < 4 * name_words; ++i) {
      if (i % 4 == 0) plain.push_back(0);
      if (i < name.size()) plain.back() |= std::uint32_t{static_cast<unsigned char>(name[i])} << 8 * (i % 4);
    }
  }
  return plain;
}

std::set<std::uint32_t> remainder_widths(Words spirv) {
  std::map<std::uint32_t, std::uint32_t> vectors;  // components, by the type's id
  std::set<std::uint32_t> widths;
  for (std::size_t at = kHeaderWords; at < spirv.size();) {
    const std::size_t count = std::clamp<std::size_t>(spirv[at] >> 16, 1, spirv.size() - at);
    const Words words = spirv.subspan(at, count);
    at += count;
    const std::uint32_t opcode = words[0] & 0xffffU;
    if (opcode == kOpTypeVector && count >= 4) vectors[words[1]] = words[3];
    if (opcode != kOpFMod || count < 2) continue;
    const auto vector = vectors.find(words[1]);
    widths.insert(vector == vectors.end() ? 1 : vector->second);
  }
  return widths;
}

ShaderInterface joined(const ShaderInterface& vertex, const ShaderInterface& fragment) {
  ShaderInterface both = fragment;
  both.constants.insert(both.constants.begin(), vertex.constants.begin(), vertex.constants.end());
  join(both.samplers, vertex.samplers);
  join(both.uniform_blocks, vertex.uniform_blocks);
  check_places(both);
  return both;
}

}  // namespace reliefbench
