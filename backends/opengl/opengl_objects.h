#pragma once
#include <epoxy/gl.h>

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include "backends/backend.h"
#include "backends/opengl/egl.h"
#include "backends/pipeline_cache.h"
#include "kernels/base/error.h"

namespace reliefbench {

/// What an error code of glGetError and a status of glGetGraphicsResetStatus say has failed.
[[nodiscard]] Fault fault_of_gl(GLenum error, GLenum reset);

/// throws: Error(environment) naming the first OpenGL error since the last check, or the context's reset, if there was
/// one
void check_gl(std::string_view what);

/// An immutable texture with its sampler state; one mipmap level, so texelFetch and textureLod(..., 0) both work.
class OpenglTexture final : public Texture {
 public:
  /// throws: Error(bad_input): `texels` has not the size that the format asks for
  OpenglTexture(const EglContext& context, const TextureDesc& desc);
  ~OpenglTexture() override;
  OpenglTexture(const OpenglTexture&) = delete;
  OpenglTexture& operator=(const OpenglTexture&) = delete;
  [[nodiscard]] GLuint id() const { return id_; }

 private:
  const EglContext& context_;
  GLuint id_ = 0;
};

/// Where the current context's programs are kept: nowhere if its driver gives no binaries of them, or none to be had.
[[nodiscard]] PipelineCache program_cache();

/// A program from SPIR-V modules, or from the driver's own binary of it.
class OpenglProgram {
 public:
  struct Stage {
    GLenum kind;
    std::span<const std::uint32_t> spirv;
  };
  /// Where a program is kept, and the pipeline that is told of it.
  struct Kept {
    const PipelineCache& cache;
    std::string key;
    Pipeline& pipeline;
  };
  /// kept: none: it is linked anew
  /// throws: Error(environment) with the driver's log: broken module, or it does not specialise or link
  OpenglProgram(const EglContext& context, const std::string& label, std::span<const Stage> stages,
                std::span<const SpecConstant> constants, const std::optional<Kept>& kept = std::nullopt);
  ~OpenglProgram();
  OpenglProgram(const OpenglProgram&) = delete;
  OpenglProgram& operator=(const OpenglProgram&) = delete;
  [[nodiscard]] GLuint id() const { return id_; }

 private:
  void attach(const Stage& stage, const std::string& label, std::span<const SpecConstant> constants) const;
  [[nodiscard]] bool is_linked() const;
  /// Whether the driver takes the bytes: its binary of the program, and that one's format.
  [[nodiscard]] bool load(std::span<const std::byte> bytes) const;
  void keep(const Kept& kept) const;

  const EglContext& context_;
  GLuint id_;
};

class OpenglPipeline final : public Pipeline {
 public:
  OpenglPipeline(const EglContext& context, const PipelineDesc& desc, const PipelineCache& cache);
  [[nodiscard]] GLuint program() const { return program_.id(); }
  [[nodiscard]] const Target& target() const { return target_; }
  [[nodiscard]] const ShaderInterface& shader() const { return shader_; }

 private:
  ShaderInterface shader_;
  Target target_;
  OpenglProgram program_;
};

/// The attachments that frames of one Target are drawn into. The context frees them.
struct GlTarget {
  Target target;
  int width = 0;  ///< 0: nothing was drawn yet
  int height = 0;
  GLuint framebuffer = 0;
  std::vector<GLuint> textures{};  ///< the colors, then the depth

  /// Makes the attachments anew where the size changed.
  /// throws: Error(environment): the device cannot draw into a frame of this size
  void resize(int new_width, int new_height);
  /// What a frame of this target starts from, where it starts from anything.
  void clear() const;
  /// Reads the attachment of that name into `bytes`; false: it has no such
  [[nodiscard]] bool read(std::string_view attachment, std::vector<std::uint8_t>& bytes) const;
  /// Makes the attachments the images that a compute shader puts its pixels into.
  void bind_images(const ShaderInterface& shader) const;
};

}  // namespace reliefbench
