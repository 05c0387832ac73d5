#include "backends/opengl/opengl_compute.h"

#include <array>
#include <cassert>
#include <deque>

#include "backends/compute_bands.h"
#include "backends/counter.h"
#include "kernels/base/error.h"

namespace reliefbench {
namespace {

/// throws: Error(environment) if so much of what it limits is too much
void check_limit(std::string_view what, std::size_t wanted, std::string_view name, GLenum limit) {
  GLint64 most = 0;
  glGetInteger64v(limit, &most);
  if (wanted > static_cast<std::size_t>(most))
    fail_environment("OpenGL: a buffer of {} {}; {} takes {} ({})", wanted, what,
                     reinterpret_cast<const char*>(glGetString(GL_RENDERER)), most, name);
}

class BufferOnDevice {
 public:
  BufferOnDevice(const EglContext& context, std::size_t bytes) : context_(context), bytes_(bytes) {
    check_limit("bytes", bytes, "GL_MAX_SHADER_STORAGE_BLOCK_SIZE", GL_MAX_SHADER_STORAGE_BLOCK_SIZE);
    glCreateBuffers(1, &id_);
    glNamedBufferStorage(id_, static_cast<GLsizeiptr>(bytes), nullptr, GL_DYNAMIC_STORAGE_BIT);
  }
  ~BufferOnDevice() {
    if (!context_.can_free()) return;
    glDeleteTextures(1, &texels_);  // 0 is no texture
    glDeleteBuffers(1, &id_);
  }
  BufferOnDevice(const BufferOnDevice&) = delete;
  BufferOnDevice& operator=(const BufferOnDevice&) = delete;

  void write(std::span<const std::byte> bytes) const {
    glNamedBufferSubData(id_, 0, static_cast<GLsizeiptr>(bytes.size()), bytes.data());
  }
  void bind(int binding, BufferView view) {
    const auto place = static_cast<GLuint>(binding);
    if (view == BufferView::texels) return glBindTextureUnit(place, texels());
    glBindBufferBase(view == BufferView::block ? GL_UNIFORM_BUFFER : GL_SHADER_STORAGE_BUFFER, place, id_);
  }
  [[nodiscard]] GLuint id() const { return id_; }

 private:
  GLuint texels() {
    if (texels_ != 0) return texels_;
    check_limit("texels", bytes_ / kBufferTexelBytes, "GL_MAX_TEXTURE_BUFFER_SIZE", GL_MAX_TEXTURE_BUFFER_SIZE);
    glCreateTextures(GL_TEXTURE_BUFFER, 1, &texels_);
    glTextureBuffer(texels_, GL_RGBA32F, id_);
    return texels_;
  }

  const EglContext& context_;
  std::size_t bytes_;
  GLuint id_ = 0;
  GLuint texels_ = 0;  ///< the same bytes
};

/// Stamps of the device's clock at the boundaries of a job's parts; none where it has no clock.
class PartClock {
 public:
  explicit PartClock(const EglContext& context) : context_(context) {
    glGetQueryiv(GL_TIMESTAMP, GL_QUERY_COUNTER_BITS, &bits_);
  }
  ~PartClock() {
    if (context_.can_free()) glDeleteQueries(static_cast<GLsizei>(stamps_.size()), stamps_.data());
  }
  PartClock(const PartClock&) = delete;
  PartClock& operator=(const PartClock&) = delete;

  /// The part before it ends here. part: "" for none
  void begin(std::string_view part) {
    if (bits_ == 0 || (!parts_.empty() && parts_.back() == part)) return;
    parts_.emplace_back(part);
    GLuint stamp = 0;
    glCreateQueries(GL_TIMESTAMP, 1, &stamp);
    glFlush();
    glQueryCounter(stamp, GL_TIMESTAMP);
    glFlush();
    stamps_.push_back(stamp);
  }

  [[nodiscard]] std::vector<ComputeTime> times() const {
    std::vector<GLuint64> ns(stamps_.size());
    for (std::size_t i = 0; i < ns.size(); ++i) glGetQueryObjectui64v(stamps_[i], GL_QUERY_RESULT, &ns[i]);
    std::vector<ComputeTime> times;
    for (std::size_t i = 0; i + 1 < ns.size(); ++i)
      add_time(times, parts_[i], static_cast<double>(counter_ticks(ns[i], ns[i + 1], bits_)));
    return times;
  }

 private:
  const EglContext& context_;
  GLint bits_ = 0;  ///< of the clock, which wraps round; 0: there is none
  std::vector<std::string> parts_;
  std::vector<GLuint> stamps_;
};

const OpenglCompute& program_of(const ComputePass& pass) {
  assert(pass.pipeline);
  return static_cast<const OpenglCompute&>(*pass.pipeline);
}

void run_pass(const ComputeJob& job, const ComputePass& pass, BufferOnDevice& dispatch,
              std::deque<BufferOnDevice>& buffers) {
  const OpenglCompute& pipeline = program_of(pass);
  assert(pipeline.views().size() == kFirstBufferBinding + pass.buffers.size());
  glUseProgram(pipeline.program());
  const auto bind = [&](int binding, BufferOnDevice& buffer) {
    buffer.bind(binding, pipeline.views()[static_cast<std::size_t>(binding)]);
  };
  bind(kDispatchBinding, dispatch);
  int binding = kFirstBufferBinding;
  for (const int buffer : pass.buffers) bind(binding++, buffers[static_cast<std::size_t>(buffer)]);
  const auto run_rows = [&](int first, int count) {
    const std::array<GLint, 2> values{first, pass.argument};
    dispatch.write(std::as_bytes(std::span(values)));
    glDispatchCompute(static_cast<GLuint>(pass.groups_x), static_cast<GLuint>(count),
                      static_cast<GLuint>(pass.groups_z));
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
  };
  if (pass.may_be_long) {
    run_in_bands(pass.groups_y, [&](int first, int count) {
      run_rows(first, count);
      glFinish();
      if (job.on_progress) job.on_progress();
    });
  } else {
    run_rows(0, pass.groups_y);
  }
  check_gl(fmt::format("run {}", pipeline.label()));
}

}  // namespace

OpenglCompute::OpenglCompute(const EglContext& context, const ComputeDesc& desc, const PipelineCache& cache)
    : label_(desc.label),
      views_(buffer_views(desc.spirv, kFirstBufferBinding + desc.buffers)),
      program_(context, desc.label, std::array{OpenglProgram::Stage{.kind = GL_COMPUTE_SHADER, .spirv = desc.spirv}},
               {}, OpenglProgram::Kept{.cache = cache, .key = cache.key(desc), .pipeline = *this}) {}

ComputeResult run_compute(const EglContext& context, const ComputeJob& job) {
  std::deque<BufferOnDevice> buffers;
  for (const ComputeBuffer& buffer : job.buffers) buffers.emplace_back(context, buffer.bytes);
  BufferOnDevice dispatch(context, 2 * sizeof(GLint));
  check_gl("make a job's buffers");

  PartClock clock(context);
  clock.begin("upload");
  for (std::size_t i = 0; i < buffers.size(); ++i)
    if (!job.buffers[i].contents.empty()) buffers[i].write(job.buffers[i].contents);
  for (const ComputePass& pass : job.passes) {
    clock.begin(pass.part);
    run_pass(job, pass, dispatch, buffers);
  }
  clock.begin("read_back");
  const auto result = static_cast<std::size_t>(job.result);
  std::vector<std::byte> bytes(job.buffers[result].bytes);
  glGetNamedBufferSubData(buffers[result].id(), 0, static_cast<GLsizeiptr>(bytes.size()), bytes.data());
  clock.begin("");
  check_gl("read a job's result");
  return {.bytes = std::move(bytes), .times = clock.times()};
}

}  // namespace reliefbench
