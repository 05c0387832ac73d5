#include "backends/opengl/opengl_objects.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "backends/spirv.h"
#include "kernels/base/clock.h"
#include "kernels/base/error.h"

namespace reliefbench {
namespace {

struct GlFormat {
  GLenum internal;
  GLenum layout;
  GLenum type;
};

GlFormat gl_format(const TexelLayout& texel) {
  const auto pick = [&](GLenum one, GLenum two, GLenum four) {
    return texel.channels == 1 ? one : (texel.channels == 2 ? two : four);
  };
  const GLenum layout = pick(GL_RED, GL_RG, GL_RGBA);
  switch (texel.type) {
    case TexelType::unorm8:
      return {pick(GL_R8, GL_RG8, GL_RGBA8), layout, GL_UNSIGNED_BYTE};
    case TexelType::unorm16:
      return {pick(GL_R16, GL_RG16, GL_RGBA16), layout, GL_UNSIGNED_SHORT};
    case TexelType::float16:
      return {pick(GL_R16F, GL_RG16F, GL_RGBA16F), layout, GL_HALF_FLOAT};
    case TexelType::float32:
      return {pick(GL_R32F, GL_RG32F, GL_RGBA32F), layout, GL_FLOAT};
    case TexelType::rgtc:  // the type is of no use to blocks
      return {pick(GL_COMPRESSED_RED_RGTC1, GL_COMPRESSED_RG_RGTC2, GL_NONE), layout, GL_NONE};
    case TexelType::eac:
      return {pick(GL_COMPRESSED_R11_EAC, GL_COMPRESSED_RG11_EAC, GL_NONE), layout, GL_NONE};
    case TexelType::bc7:
      return {GL_COMPRESSED_RGBA_BPTC_UNORM, layout, GL_NONE};
    case TexelType::astc:
      return {GL_COMPRESSED_RGBA_ASTC_4x4_KHR, layout, GL_NONE};
  }
  fail_environment("OpenGL: no such texel type");
}

std::string error_name(GLenum error) {
  switch (error) {
    case GL_INVALID_ENUM:
      return "GL_INVALID_ENUM";
    case GL_INVALID_VALUE:
      return "GL_INVALID_VALUE";
    case GL_INVALID_OPERATION:
      return "GL_INVALID_OPERATION";
    case GL_INVALID_FRAMEBUFFER_OPERATION:
      return "GL_INVALID_FRAMEBUFFER_OPERATION";
    case GL_OUT_OF_MEMORY:
      return "GL_OUT_OF_MEMORY";
    case GL_CONTEXT_LOST:
      return "GL_CONTEXT_LOST";
    case GL_GUILTY_CONTEXT_RESET:
      return "GL_GUILTY_CONTEXT_RESET";
    case GL_INNOCENT_CONTEXT_RESET:
      return "GL_INNOCENT_CONTEXT_RESET";
    case GL_UNKNOWN_CONTEXT_RESET:
      return "GL_UNKNOWN_CONTEXT_RESET";
    default:
      return fmt::format("0x{:04x}", error);
  }
}

/// The first error since the last call, and the others forgotten.
GLenum take_error() {
  const GLenum first = glGetError();
  // There may be a flag for each distributed part; a lost context would report for ever.
  for (int i = 0; i < 8 && glGetError() != GL_NO_ERROR; ++i) continue;
  return first;
}

/// The driver's log of a shader or a program as one line.
template <typename Get>
std::string info_log(GLuint object, const Get& get) {
  std::array<char, 1024> log{};
  get(object, static_cast<GLsizei>(log.size()), nullptr, log.data());
  std::string text = log.data();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

std::vector<OpenglProgram::Stage> stages_of(const PipelineDesc& desc) {
  if (desc.target.by_compute) return {{.kind = GL_COMPUTE_SHADER, .spirv = desc.fragment}};
  return {{.kind = GL_VERTEX_SHADER, .spirv = desc.vertex}, {.kind = GL_FRAGMENT_SHADER, .spirv = desc.fragment}};
}

}  // namespace

Fault fault_of_gl(GLenum error, GLenum reset) {
  if (error == GL_CONTEXT_LOST || reset != GL_NO_ERROR) return Fault::device_lost;
  return error == GL_OUT_OF_MEMORY ? Fault::out_of_memory : Fault::other;
}

void check_gl(std::string_view what) {
  const GLenum error = take_error();
  const GLenum reset = glGetGraphicsResetStatus();
  if (error == GL_NO_ERROR && reset == GL_NO_ERROR) return;
  fail_device(fault_of_gl(error, reset), "OpenGL: {} while trying to {}",
              error_name(reset != GL_NO_ERROR ? reset : error), what);
}

OpenglTexture::OpenglTexture(const EglContext& context, const TextureDesc& desc) : context_(context) {
  const std::size_t expected = texture_bytes(desc);
  if (desc.width < 1 || desc.height < 1 || desc.texels.size() != expected)
    fail_input("texture of {}x{} texels: {} bytes given, {} expected", desc.width, desc.height, desc.texels.size(),
               expected);
  GLint limit = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &limit);
  if (desc.width > limit || desc.height > limit)
    fail_environment("opengl: no image of {}x{}: the device takes sides of 1 to {}", desc.width, desc.height, limit);
  const GlFormat format = gl_format(desc.layout);
  glCreateTextures(GL_TEXTURE_2D, 1, &id_);
  glTextureStorage2D(id_, desc.levels, format.internal, desc.width, desc.height);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  const std::byte* texels = desc.texels.data();
  for (int level = 0; level < desc.levels; ++level) {
    const int width = level_side(desc.width, level);
    const int height = level_side(desc.height, level);
    if (is_of_blocks(desc.layout.type)) {
      glCompressedTextureSubImage2D(id_, level, 0, 0, width, height, format.internal,
                                    static_cast<GLsizei>(level_bytes(desc, level)), texels);
    } else {
      glTextureSubImage2D(id_, level, 0, 0, width, height, format.layout, format.type, texels);
    }
    texels += level_bytes(desc, level);
  }
  if (desc.layout.type == TexelType::astc) glTextureParameteri(id_, GL_TEXTURE_SWIZZLE_G, GL_ALPHA);
  const GLint filter = desc.filter == Filter::linear ? GL_LINEAR : GL_NEAREST;
  const GLint wrap = desc.wrap == Wrap::repeat ? GL_REPEAT : GL_CLAMP_TO_EDGE;
  const GLint nearest_level = desc.filter == Filter::linear ? GL_LINEAR_MIPMAP_NEAREST : GL_NEAREST_MIPMAP_NEAREST;
  glTextureParameteri(id_, GL_TEXTURE_MIN_FILTER, desc.levels > 1 ? nearest_level : filter);
  glTextureParameteri(id_, GL_TEXTURE_MAG_FILTER, filter);
  glTextureParameteri(id_, GL_TEXTURE_WRAP_S, wrap);
  glTextureParameteri(id_, GL_TEXTURE_WRAP_T, wrap);
  glTextureParameteri(id_, GL_TEXTURE_MAX_LEVEL, desc.levels - 1);
  glFinish();
}

OpenglTexture::~OpenglTexture() {
  if (context_.can_free()) glDeleteTextures(1, &id_);
}

PipelineCache program_cache() {
  GLint formats = 0;
  glGetIntegerv(GL_NUM_PROGRAM_BINARY_FORMATS, &formats);
  std::string driver = "opengl";
  for (const GLenum name : {GL_VENDOR, GL_RENDERER, GL_VERSION})
    driver += fmt::format(" {}", reinterpret_cast<const char*>(glGetString(name)));
  // Mesa 22.3 says that it has a format, and crashes: uniforms of programs from SPIR-V have no names.
  return formats < 1 || driver.find("Mesa") != std::string::npos ? PipelineCache() : PipelineCache(std::move(driver));
}

OpenglProgram::OpenglProgram(const EglContext& context, const std::string& label, std::span<const Stage> stages,
                             std::span<const SpecConstant> constants, const std::optional<Kept>& kept)
    : context_(context), id_(glCreateProgram()) {
  try {
    const auto known = kept ? kept->cache.get(kept->key) : std::nullopt;
    if (known && load(*known)) {
      kept->pipeline.is_from_cache = true;
    } else {
      if (kept && kept->cache.keeps()) glProgramParameteri(id_, GL_PROGRAM_BINARY_RETRIEVABLE_HINT, GL_TRUE);
      for (const Stage& stage : stages) attach(stage, label, constants);
      glLinkProgram(id_);
      if (!is_linked()) fail_environment("OpenGL: {} does not link: {}", label, info_log(id_, glGetProgramInfoLog));
      if (kept && kept->cache.keeps() && !known) keep(*kept);
    }
    const auto length = static_cast<GLsizei>(std::min<std::size_t>(label.size(), 255));
    glObjectLabel(GL_PROGRAM, id_, length, label.data());
    check_gl(fmt::format("compile {}", label));
  } catch (const Error&) {
    glDeleteProgram(id_);
    throw;
  }
}

OpenglProgram::~OpenglProgram() {
  if (context_.can_free()) glDeleteProgram(id_);
}

bool OpenglProgram::is_linked() const {
  GLint linked = GL_FALSE;
  glGetProgramiv(id_, GL_LINK_STATUS, &linked);
  return linked == GL_TRUE;
}

bool OpenglProgram::load(std::span<const std::byte> bytes) const {
  GLenum format = 0;
  if (bytes.size() <= sizeof(format)) return false;
  const std::span<const std::byte> binary = bytes.first(bytes.size() - sizeof(format));
  std::memcpy(&format, bytes.data() + binary.size(), sizeof(format));
  glProgramBinary(id_, format, binary.data(), static_cast<GLsizei>(binary.size()));
  return take_error() == GL_NO_ERROR && is_linked();
}

void OpenglProgram::keep(const Kept& kept) const {
  const double start_ns = steady_ns();
  kept.cache.put(kept.key, {});  // a driver that dies over what follows is not asked again: this is nothing to load
  GLint size = 0;
  glGetProgramiv(id_, GL_PROGRAM_BINARY_LENGTH, &size);
  std::vector<std::byte> bytes(static_cast<std::size_t>(size));
  GLenum format = 0;
  glGetProgramBinary(id_, size, &size, &format, bytes.data());
  if (take_error() == GL_NO_ERROR && size > 0) {
    bytes.resize(static_cast<std::size_t>(size));
    const auto its_format = std::as_bytes(std::span(&format, 1));
    bytes.insert(bytes.end(), its_format.begin(), its_format.end());
    kept.cache.put(kept.key, bytes);
  }
  kept.pipeline.keeping_ns = steady_ns() - start_ns;
}

void OpenglProgram::attach(const Stage& stage, const std::string& label,
                           std::span<const SpecConstant> constants) const {
  // OpenGL refuses ids that the module does not declare.
  const std::vector<DeclaredConstant> declared = reflect(stage.spirv).constants;
  std::vector<GLuint> ids;
  std::vector<GLuint> values;
  for (const SpecConstant& constant : constants)
    if (std::any_of(declared.begin(), declared.end(), [&](const auto& known) { return known.id == constant.id; })) {
      ids.push_back(constant.id);
      values.push_back(static_cast<GLuint>(constant.value));
    }

  const GLuint shader = glCreateShader(stage.kind);
  glAttachShader(id_, shader);
  glDeleteShader(shader);  // the program keeps it
  glShaderBinary(1, &shader, GL_SHADER_BINARY_FORMAT_SPIR_V_ARB, stage.spirv.data(),
                 static_cast<GLsizei>(stage.spirv.size_bytes()));
  glSpecializeShaderARB(shader, "main", static_cast<GLuint>(ids.size()), ids.data(), values.data());
  GLint compiled = GL_FALSE;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
  const GLenum error = take_error();
  if (compiled != GL_TRUE || error != GL_NO_ERROR)
    fail_device(fault_of_gl(error, glGetGraphicsResetStatus()), "OpenGL: {} does not specialise ({}): {}", label,
                error_name(error), info_log(shader, glGetShaderInfoLog));
}

OpenglPipeline::OpenglPipeline(const EglContext& context, const PipelineDesc& desc, const PipelineCache& cache)
    : shader_(interface_of(desc)),
      target_(desc.target),
      program_(context, desc.label, stages_of(desc), desc.constants,
               OpenglProgram::Kept{.cache = cache, .key = cache.key(desc), .pipeline = *this}) {}

void GlTarget::resize(int new_width, int new_height) {
  if (new_width == width && new_height == height) return;
  glDeleteFramebuffers(1, &framebuffer);
  glDeleteTextures(static_cast<GLsizei>(textures.size()), textures.data());
  width = height = 0;

  const std::size_t colors = target.attachments.size();
  textures.resize(colors + (target.has_depth ? 1 : 0));
  std::vector<GLenum> slots;
  glCreateFramebuffers(1, &framebuffer);
  glCreateTextures(GL_TEXTURE_2D, static_cast<GLsizei>(textures.size()), textures.data());
  for (std::size_t i = 0; i < textures.size(); ++i) {
    const bool is_depth = i == colors;
    const GLenum format = is_depth ? GL_DEPTH_COMPONENT32F : gl_format(target.attachments[i].layout).internal;
    const GLenum slot = is_depth ? GL_DEPTH_ATTACHMENT : GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(i);
    glTextureStorage2D(textures[i], 1, format, new_width, new_height);
    glNamedFramebufferTexture(framebuffer, slot, textures[i], 0);
    if (!is_depth) slots.push_back(slot);
  }
  glNamedFramebufferDrawBuffers(framebuffer, static_cast<GLsizei>(slots.size()), slots.data());
  check_gl(fmt::format("make a frame of {}x{} px", new_width, new_height));
  if (glCheckNamedFramebufferStatus(framebuffer, GL_DRAW_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    fail_environment("OpenGL: the device cannot draw into a frame of {}x{} px", new_width, new_height);
  width = new_width;
  height = new_height;
}

void GlTarget::clear() const {
  if (!target.has_depth) return;
  constexpr std::array<GLfloat, 4> kBlack{};
  constexpr GLfloat kFarthest = 1;
  for (std::size_t i = 0; i < target.attachments.size(); ++i)
    glClearNamedFramebufferfv(framebuffer, GL_COLOR, static_cast<GLint>(i), kBlack.data());
  glClearNamedFramebufferfv(framebuffer, GL_DEPTH, 0, &kFarthest);
}

void GlTarget::bind_images(const ShaderInterface& shader) const {
  for (const ShaderVariable& image : shader.images)
    for (std::size_t i = 0; i < target.attachments.size(); ++i)
      if (target.attachments[i].name == image.name)
        glBindImageTexture(image.place, textures[i], 0, GL_FALSE, 0, GL_WRITE_ONLY,
                           gl_format(target.attachments[i].layout).internal);
}

bool GlTarget::read(std::string_view attachment, std::vector<std::uint8_t>& bytes) const {
  for (std::size_t i = 0; i < textures.size(); ++i) {
    const bool is_depth = i == target.attachments.size();
    const Attachment& here = is_depth ? kDepth : target.attachments[i];
    if (here.name != attachment || width == 0) continue;
    const GlFormat format = gl_format(here.layout);
    bytes.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                 static_cast<std::size_t>(here.layout.bytes()));
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glGetTextureImage(textures[i], 0, is_depth ? GL_DEPTH_COMPONENT : format.layout, format.type,
                      static_cast<GLsizei>(bytes.size()), bytes.data());
    check_gl(fmt::format("read the attachment {}", attachment));
    return true;
  }
  return false;
}

}  // namespace reliefbench
