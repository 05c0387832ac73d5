#include "backends/opengl/opengl_compute.h"

#include <array>
#include <cassert>

#include "backends/compute_bands.h"
#include "kernels/base/error.h"

namespace reliefbench {
namespace {

/// A shader storage buffer, bound to its binding point.
class StorageBuffer {
 public:
  /// data: null for a buffer of no content yet
  StorageBuffer(const EglContext& context, int binding, std::size_t bytes, const void* data) : context_(context) {
    GLint64 limit = 0;
    glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &limit);
    if (bytes > static_cast<std::size_t>(limit))
      fail_environment("OpenGL: a buffer of {} bytes; {} takes {}", bytes,
                       reinterpret_cast<const char*>(glGetString(GL_RENDERER)), limit);
    glCreateBuffers(1, &id_);
    glNamedBufferStorage(id_, static_cast<GLsizeiptr>(bytes), data, GL_DYNAMIC_STORAGE_BIT);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, static_cast<GLuint>(binding), id_);
  }
  ~StorageBuffer() {
    if (context_.can_free()) glDeleteBuffers(1, &id_);
  }
  StorageBuffer(const StorageBuffer&) = delete;
  StorageBuffer& operator=(const StorageBuffer&) = delete;
  [[nodiscard]] GLuint id() const { return id_; }

 private:
  const EglContext& context_;
  GLuint id_ = 0;
};

}  // namespace

OpenglCompute::OpenglCompute(const EglContext& context, const ComputeDesc& desc)
    : context_(context),
      label_(desc.label),
      inputs_(desc.inputs),
      program_(context, desc.label, std::array{OpenglProgram::Stage{.kind = GL_COMPUTE_SHADER, .spirv = desc.spirv}},
               {}) {}

std::vector<std::byte> OpenglCompute::run(const ComputeJob& job) const {
  assert(static_cast<int>(job.inputs.size()) == inputs_);
  const StorageBuffer output(context_, kOutputBinding, job.output_bytes, nullptr);
  const StorageBuffer band(context_, kBandBinding, sizeof(GLint), nullptr);
  std::vector<std::unique_ptr<StorageBuffer>> inputs;
  for (const std::span<const std::byte> bytes : job.inputs) {
    const int binding = kFirstInputBinding + static_cast<int>(inputs.size());
    inputs.push_back(std::make_unique<StorageBuffer>(context_, binding, bytes.size(), bytes.data()));
  }
  check_gl(fmt::format("make the buffers of {}", label_));

  glUseProgram(program_.id());
  run_in_bands(job.groups_y, [&](int first, int count) {
    glNamedBufferSubData(band.id(), 0, sizeof(first), &first);
    glDispatchCompute(static_cast<GLuint>(job.groups_x), static_cast<GLuint>(count), 1);
    glFinish();
    check_gl(fmt::format("run {}", label_));
  });
  glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
  std::vector<std::byte> result(job.output_bytes);
  glGetNamedBufferSubData(output.id(), 0, static_cast<GLsizeiptr>(result.size()), result.data());
  check_gl(fmt::format("read the result of {}", label_));
  return result;
}

}  // namespace reliefbench
