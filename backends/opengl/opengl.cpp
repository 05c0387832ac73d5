#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <chrono>
#include <utility>

#include "backends/backend.h"
#include "backends/counter.h"
#include "backends/opengl/egl.h"
#include "backends/opengl/opengl_backend.h"
#include "backends/opengl/opengl_compute.h"
#include "backends/opengl/opengl_objects.h"
#include "kernels/base/error.h"

namespace reliefbench {
namespace {

std::string text_of(GLenum name) {
  const GLubyte* text = glGetString(name);
  return text == nullptr ? "" : reinterpret_cast<const char*>(text);
}

DeviceInfo describe(int index) {
  const std::string renderer = text_of(GL_RENDERER);
  const auto is_one_of = [&](std::initializer_list<std::string_view> names) {
    return std::any_of(names.begin(), names.end(),
                       [&](std::string_view name) { return renderer.find(name) != std::string::npos; });
  };
  const bool software = is_one_of({"llvmpipe", "softpipe", "swrast", "SWR", "Software"});
  DeviceInfo info{.backend = "opengl",
                  .index = index,
                  .name = renderer,
                  .vendor = text_of(GL_VENDOR),
                  .type = software ? "cpu" : (is_one_of({"virgl", "SVGA3D"}) ? "virtual" : "other"),
                  .driver = text_of(GL_VERSION),
                  .api_version = "",
                  .software = software,
                  .timers = {Timer::fenced_wall},
                  .float64 = true,                                               // OpenGL 4.0 asks for it
                  .blocks = {TexelType::rgtc, TexelType::eac, TexelType::bc7}};  // 3.0, 4.3 and 4.2 do
  if (epoxy_has_gl_extension("GL_KHR_texture_compression_astc_ldr")) info.blocks.push_back(TexelType::astc);
  GLint major = 0;
  GLint minor = 0;
  glGetIntegerv(GL_MAJOR_VERSION, &major);
  glGetIntegerv(GL_MINOR_VERSION, &minor);
  info.api_version = fmt::format("OpenGL {}.{} core", major, minor);
  GLint bits = 0;
  glGetQueryiv(GL_TIME_ELAPSED, GL_QUERY_COUNTER_BITS, &bits);
  if (bits > 0) info.timers.push_back(Timer::gl_time_elapsed);
  glGetQueryiv(GL_TIMESTAMP, GL_QUERY_COUNTER_BITS, &bits);
  if (bits > 0) info.timers.push_back(Timer::gl_timestamp);
  check_gl("describe the device");
  return info;
}

struct UsableDevice {
  EGLDisplay display;
  DeviceInfo info;
};

constexpr std::size_t kUniformStride = 256;  // the greatest GL_UNIFORM_BUFFER_OFFSET_ALIGNMENT that OpenGL allows
static_assert(sizeof(FrameUniforms) <= kUniformStride);

class OpenglBackend final : public Backend {
 public:
  OpenglBackend(const UsableDevice& device, const BackendOptions& options)
      : context_(device.display, options.debug), device_(device.info) {
    set_up(options);
  }
  OpenglBackend(const EglContext::Borrowed& window, const BackendOptions& options)
      : context_(window), device_(describe(0)), is_in_window_(true) {
    set_up(options);
  }
  // The context takes its objects with it.
  ~OpenglBackend() override = default;
  OpenglBackend(const OpenglBackend&) = delete;
  OpenglBackend& operator=(const OpenglBackend&) = delete;

  [[nodiscard]] std::optional<GLuint> texture_in_window() const;
  [[nodiscard]] const DeviceInfo& device() const override { return device_; }

  [[nodiscard]] std::unique_ptr<Texture> upload(const TextureDesc& desc) override {
    context_.make_current();
    auto texture = std::make_unique<OpenglTexture>(context_, desc);
    check_gl(fmt::format("upload a texture of {}x{} texels", desc.width, desc.height));
    return texture;
  }

  [[nodiscard]] std::unique_ptr<Pipeline> compile(const PipelineDesc& desc) override {
    context_.make_current();
    return std::make_unique<OpenglPipeline>(context_, desc, pipelines_);
  }

  BatchTime render(std::span<const Draw> frame, int frames, Timer timer) override;
  [[nodiscard]] std::span<const std::uint8_t> read(std::string_view attachment) override;
  [[nodiscard]] std::unique_ptr<Pipeline> compile_compute(const ComputeDesc& desc) override {
    context_.make_current();
    return std::make_unique<OpenglCompute>(context_, desc, pipelines_);
  }
  [[nodiscard]] ComputeResult compute(const ComputeJob& job) override {
    context_.make_current();
    return run_compute(context_, job);
  }
  [[nodiscard]] std::vector<std::string> debug_messages() const override { return messages_; }

 private:
  static void GLAPIENTRY on_message(GLenum /*source*/, GLenum type, GLuint /*id*/, GLenum severity, GLsizei length,
                                    const GLchar* text, const void* messages) {
    // Remarks on speed and statistics of shaders are no faults.
    if (severity == GL_DEBUG_SEVERITY_NOTIFICATION || type == GL_DEBUG_TYPE_PERFORMANCE) return;
    auto* list = static_cast<std::vector<std::string>*>(const_cast<void*>(messages));
    list->emplace_back(text, static_cast<std::size_t>(length));
  }

  void set_up(const BackendOptions& options);
  GlTarget& prepare_target(const Draw& first);
  void write_uniforms(std::span<const Draw> frame);
  void bind(const Draw& draw, std::size_t index) const;
  static void put_pixels(const Draw& draw);
  void draw_frame(std::span<const Draw> frame) const;
  [[nodiscard]] std::optional<double> device_time_ns(Timer timer) const;

  EglContext context_;
  DeviceInfo device_;
  bool is_in_window_ = false;
  PipelineCache pipelines_;
  std::vector<std::string> messages_;
  GLuint empty_vertices_ = 0;
  GLuint uniforms_ = 0;
  std::size_t uniform_slots_ = 0;  ///< draws that `uniforms_` has room for
  GLuint elapsed_ = 0;
  std::array<GLuint, 2> stamps_{};
  GLint stamp_bits_ = 0;           ///< of their counter, which wraps round; OpenGL promises 30
  std::vector<GlTarget> targets_;  ///< the one drawn last at the end
  std::vector<std::uint8_t> read_;
};

void OpenglBackend::set_up(const BackendOptions& options) {
  if (options.debug) {
    glEnable(GL_DEBUG_OUTPUT);
    glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
    glDebugMessageCallback(&OpenglBackend::on_message, &messages_);
  }
  glDisable(GL_DITHER);  // the only stage that is on by default and would touch a pixel
  glCreateVertexArrays(1, &empty_vertices_);
  glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);  // depths as Vulkan has them
  glDepthFunc(GL_LESS);
  glCreateQueries(GL_TIME_ELAPSED, 1, &elapsed_);
  glCreateQueries(GL_TIMESTAMP, 2, stamps_.data());
  glGetQueryiv(GL_TIMESTAMP, GL_QUERY_COUNTER_BITS, &stamp_bits_);
  if (options.keeps_pipelines) pipelines_ = program_cache();
  check_gl("set up the context");
}

GlTarget& OpenglBackend::prepare_target(const Draw& first) {
  const Target& wanted = static_cast<const OpenglPipeline&>(*first.pipeline).target();
  const auto found = std::ranges::find(targets_, wanted, &GlTarget::target);
  if (found == targets_.end())
    targets_.push_back({.target = wanted});
  else
    std::rotate(found, found + 1, targets_.end());
  targets_.back().resize(first.frame.sizes[0], first.frame.sizes[1]);
  return targets_.back();
}

void OpenglBackend::write_uniforms(std::span<const Draw> frame) {
  if (frame.size() > uniform_slots_) {
    glDeleteBuffers(1, &uniforms_);
    glCreateBuffers(1, &uniforms_);
    glNamedBufferStorage(uniforms_, static_cast<GLsizeiptr>(frame.size() * kUniformStride), nullptr,
                         GL_DYNAMIC_STORAGE_BIT);
    uniform_slots_ = frame.size();
  }
  for (std::size_t i = 0; i < frame.size(); ++i)
    glNamedBufferSubData(uniforms_, static_cast<GLintptr>(i * kUniformStride), sizeof(FrameUniforms), &frame[i].frame);
}

/// Makes a draw's program, uniforms and textures the context's. index: of the draw in its frame
void OpenglBackend::bind(const Draw& draw, std::size_t index) const {
  const auto& pipeline = static_cast<const OpenglPipeline&>(*draw.pipeline);
  glUseProgram(pipeline.program());
  for (const ShaderVariable& block : pipeline.shader().uniform_blocks)
    glBindBufferRange(GL_UNIFORM_BUFFER, block.place, uniforms_, static_cast<GLintptr>(index * kUniformStride),
                      sizeof(FrameUniforms));
  for (const ShaderVariable& sampler : pipeline.shader().samplers)
    glBindTextureUnit(sampler.place, static_cast<const OpenglTexture&>(texture_of(draw, sampler.name)).id());
  targets_.back().bind_images(pipeline.shader());
}

/// A triangle list, or groups of a compute shader: each dispatch waits until the one before has put its pixels.
void OpenglBackend::put_pixels(const Draw& draw) {
  const auto& pipeline = static_cast<const OpenglPipeline&>(*draw.pipeline);
  if (!pipeline.target().by_compute) return glDrawArrays(GL_TRIANGLES, 0, draw.vertices);
  const auto [columns, rows] = groups_of(pipeline.shader(), draw.frame);
  glDispatchCompute(columns, rows, 1);
  glMemoryBarrier(GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
}

void OpenglBackend::draw_frame(std::span<const Draw> frame) const {
  targets_.back().clear();
  for (std::size_t i = 0; i < frame.size(); ++i) {
    if (frame.size() > 1) bind(frame[i], i);  // a lone draw stays bound
    put_pixels(frame[i]);
  }
  // Ends the frame: a tiler that sees several opaque full-screen draws at once shades only the last one.
  glFlush();
}

BatchTime OpenglBackend::render(std::span<const Draw> frame, int frames, Timer timer) {
  if (std::find(device_.timers.begin(), device_.timers.end(), timer) == device_.timers.end())
    fail_environment("OpenGL: {} does not offer the timer {}", device_.name, timer_id(timer));
  if (frame.empty() || frames < 1) fail_environment("OpenGL: a batch of {} frames of {} draws", frames, frame.size());
  context_.make_current();
  const GlTarget& target = prepare_target(frame.front());
  for (const Draw& draw : frame)
    if (static_cast<const OpenglPipeline&>(*draw.pipeline).target() != target.target)
      fail_environment("OpenGL: the draws of a frame go into different targets");
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, target.framebuffer);
  glViewport(0, 0, target.width, target.height);
  target.target.has_depth ? glEnable(GL_DEPTH_TEST) : glDisable(GL_DEPTH_TEST);
  glBindVertexArray(empty_vertices_);
  write_uniforms(frame);
  for (std::size_t i = 0; i < frame.size(); ++i) bind(frame[i], i);  // refuses a draw before the first is timed
  glFinish();

  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  if (timer == Timer::gl_time_elapsed) glBeginQuery(GL_TIME_ELAPSED, elapsed_);
  if (timer == Timer::gl_timestamp) {
    // Flushed from the draws: llvmpipe stamps once a bin, and the last bin of a shared batch would be the stamp.
    glFlush();
    glQueryCounter(stamps_[0], GL_TIMESTAMP);
    glFlush();
  }
  for (int i = 0; i < frames; ++i) draw_frame(frame);
  if (timer == Timer::gl_time_elapsed) glEndQuery(GL_TIME_ELAPSED);
  if (timer == Timer::gl_timestamp) {
    glFlush();
    glQueryCounter(stamps_[1], GL_TIMESTAMP);
    glFlush();
  }
  const GLsync fence = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
  glClientWaitSync(fence, GL_SYNC_FLUSH_COMMANDS_BIT, std::numeric_limits<GLuint64>::max());
  glDeleteSync(fence);
  const std::chrono::duration<double, std::nano> wall = Clock::now() - start;

  if (target.target.by_compute) glMemoryBarrier(GL_TEXTURE_UPDATE_BARRIER_BIT | GL_FRAMEBUFFER_BARRIER_BIT);
  const BatchTime time{.wall_ns = wall.count(), .device_ns = device_time_ns(timer)};
  check_gl("draw");
  return time;
}

std::optional<double> OpenglBackend::device_time_ns(Timer timer) const {
  if (timer == Timer::gl_time_elapsed) {
    GLuint64 elapsed_ns = 0;
    glGetQueryObjectui64v(elapsed_, GL_QUERY_RESULT, &elapsed_ns);
    return static_cast<double>(elapsed_ns);
  }
  if (timer == Timer::gl_timestamp) {
    std::array<GLuint64, 2> stamps_ns{};
    for (std::size_t i = 0; i < stamps_.size(); ++i) glGetQueryObjectui64v(stamps_[i], GL_QUERY_RESULT, &stamps_ns[i]);
    // Signed: stamps that come out of order are for the audit to see.
    return static_cast<double>(counter_span(stamps_ns[0], stamps_ns[1], stamp_bits_));
  }
  return std::nullopt;
}

std::span<const std::uint8_t> OpenglBackend::read(std::string_view attachment) {
  context_.make_current();
  for (std::size_t i = targets_.size(); i-- > 0;)  // the latest first
    if (targets_[i].read(attachment, read_)) return read_;
  fail_not_drawn("OpenGL", attachment);
}

std::optional<GLuint> OpenglBackend::texture_in_window() const {
  if (!is_in_window_) return std::nullopt;
  for (std::size_t i = targets_.size(); i-- > 0;)  // the latest first
    if (targets_[i].target.attachments == Target::color.attachments && targets_[i].width > 0)
      return targets_[i].textures.front();
  return std::nullopt;
}

/// The displays on which a context can be made, numbered as --device takes them.
std::vector<UsableDevice> usable_devices() {
  std::vector<UsableDevice> devices;
  for (EGLDisplay display : egl_displays()) {
    try {
      const EglContext context(display, false);
      devices.push_back({.display = display, .info = describe(static_cast<int>(devices.size()))});
      devices.back().info.pci = pci_address(display);
    } catch (const Error&) {
      continue;  // no OpenGL 4.5 with SPIR-V there, or not for this user
    }
  }
  return devices;
}

}  // namespace

std::vector<DeviceInfo> opengl_devices() {
  std::vector<DeviceInfo> infos;
  for (UsableDevice& device : usable_devices()) infos.push_back(std::move(device.info));
  return infos;
}

std::unique_ptr<Backend> open_opengl_in(const EglContext::Borrowed& window, const BackendOptions& options) {
  return std::make_unique<OpenglBackend>(window, options);
}

std::optional<GLuint> texture_in_window(const Backend& backend) {
  const auto* own = dynamic_cast<const OpenglBackend*>(&backend);
  return own == nullptr ? std::nullopt : own->texture_in_window();
}

std::unique_ptr<Backend> open_opengl(int device_index, const BackendOptions& options) {
  const std::vector<UsableDevice> devices = usable_devices();
  if (device_index < 0 || static_cast<std::size_t>(device_index) >= devices.size())
    fail_environment("opengl: no device {}, this machine has {}", device_index, devices.size());
  return std::make_unique<OpenglBackend>(devices[static_cast<std::size_t>(device_index)], options);
}

}  // namespace reliefbench
