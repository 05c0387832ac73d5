#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <chrono>

#include "backends/backend.h"
#include "backends/opengl/egl.h"
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
                  .float64 = true};  // OpenGL 4.0 asks for it
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

class OpenglBackend final : public Backend {
 public:
  OpenglBackend(const UsableDevice& device, const BackendOptions& options)
      : context_(device.display, options.debug), device_(device.info) {
    if (options.debug) {
      glEnable(GL_DEBUG_OUTPUT);
      glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
      glDebugMessageCallback(&OpenglBackend::on_message, &messages_);
    }
    glDisable(GL_DITHER);  // the only stage that is on by default and would touch a pixel
    glCreateVertexArrays(1, &empty_vertices_);
    glCreateBuffers(1, &uniforms_);
    glNamedBufferStorage(uniforms_, sizeof(FrameUniforms), nullptr, GL_DYNAMIC_STORAGE_BIT);
    glCreateQueries(GL_TIME_ELAPSED, 1, &elapsed_);
    glCreateQueries(GL_TIMESTAMP, 2, stamps_.data());
    check_gl("set up the context");
  }
  // The context takes its objects with it.
  ~OpenglBackend() override = default;
  OpenglBackend(const OpenglBackend&) = delete;
  OpenglBackend& operator=(const OpenglBackend&) = delete;

  [[nodiscard]] const DeviceInfo& device() const override { return device_; }

  [[nodiscard]] std::unique_ptr<Texture> upload(const TextureDesc& desc) override {
    context_.make_current();
    auto texture = std::make_unique<OpenglTexture>(context_, desc);
    check_gl(fmt::format("upload a texture of {}x{} texels", desc.width, desc.height));
    return texture;
  }

  [[nodiscard]] std::unique_ptr<Pipeline> compile(const PipelineDesc& desc) override {
    context_.make_current();
    return std::make_unique<OpenglPipeline>(context_, desc);
  }

  BatchTime render(const Draw& draw, int frames, Timer timer) override;
  [[nodiscard]] std::vector<ScorePixel> read_score() override;
  [[nodiscard]] std::vector<std::uint8_t> read_color() override;
  [[nodiscard]] std::unique_ptr<Pipeline> compile_compute(const ComputeDesc& desc) override {
    context_.make_current();
    return std::make_unique<OpenglCompute>(context_, desc);
  }
  [[nodiscard]] std::vector<std::byte> compute(const ComputeJob& job) override {
    assert(job.pipeline);
    context_.make_current();
    return static_cast<const OpenglCompute&>(*job.pipeline).run(job);
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

  void prepare(const Draw& draw);
  [[nodiscard]] std::optional<double> device_time_ns(Timer timer) const;

  EglContext context_;
  DeviceInfo device_;
  std::vector<std::string> messages_;
  GLuint empty_vertices_ = 0;
  GLuint uniforms_ = 0;
  GLuint elapsed_ = 0;
  std::array<GLuint, 2> stamps_{};
  FrameTarget color_{.format = GL_RGBA8, .attachments = 1};
  FrameTarget score_{.format = GL_RGBA32F, .attachments = 2};
};

void OpenglBackend::prepare(const Draw& draw) {
  assert(draw.pipeline && draw.relief && draw.normals && draw.reference && draw.extra);
  const auto& pipeline = static_cast<const OpenglPipeline&>(*draw.pipeline);
  FrameTarget& target = pipeline.target() == Target::score ? score_ : color_;
  target.resize(draw.frame.sizes[0], draw.frame.sizes[1]);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, target.framebuffer);
  glViewport(0, 0, target.width, target.height);
  glUseProgram(pipeline.program());
  glBindVertexArray(empty_vertices_);
  glNamedBufferSubData(uniforms_, 0, sizeof(FrameUniforms), &draw.frame);
  glBindBufferBase(GL_UNIFORM_BUFFER, kFrameBinding, uniforms_);
  glBindTextureUnit(kReliefBinding, static_cast<const OpenglTexture&>(*draw.relief).id());
  glBindTextureUnit(kNormalBinding, static_cast<const OpenglTexture&>(*draw.normals).id());
  glBindTextureUnit(kReferenceBinding, static_cast<const OpenglTexture&>(*draw.reference).id());
  glBindTextureUnit(kExtraBinding, static_cast<const OpenglTexture&>(*draw.extra).id());
}

BatchTime OpenglBackend::render(const Draw& draw, int frames, Timer timer) {
  if (std::find(device_.timers.begin(), device_.timers.end(), timer) == device_.timers.end())
    fail_environment("OpenGL: {} does not offer the timer {}", device_.name, timer_id(timer));
  context_.make_current();
  prepare(draw);
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
  for (int i = 0; i < frames; ++i) {
    glDrawArrays(GL_TRIANGLES, 0, 3);
    // Ends the frame: a tiler that sees several opaque full-screen draws at once shades only the last one.
    glFlush();
  }
  if (timer == Timer::gl_time_elapsed) glEndQuery(GL_TIME_ELAPSED);
  if (timer == Timer::gl_timestamp) {
    glFlush();
    glQueryCounter(stamps_[1], GL_TIMESTAMP);
    glFlush();
  }
  glFinish();
  const std::chrono::duration<double, std::nano> wall = Clock::now() - start;

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
    return static_cast<double>(static_cast<std::int64_t>(stamps_ns[1] - stamps_ns[0]));
  }
  return std::nullopt;
}

std::vector<ScorePixel> OpenglBackend::read_score() {
  if (score_.width == 0) fail_environment("OpenGL: no score frame was drawn");
  context_.make_current();
  const std::size_t pixels = static_cast<std::size_t>(score_.width) * static_cast<std::size_t>(score_.height);
  std::array<std::vector<float>, 2> images;
  for (std::size_t i = 0; i < images.size(); ++i) {
    images[i].resize(pixels * 4);
    glGetTextureImage(score_.textures[i], 0, GL_RGBA, GL_FLOAT, static_cast<GLsizei>(images[i].size() * sizeof(float)),
                      images[i].data());
  }
  check_gl("read the score frame");
  std::vector<ScorePixel> score(pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    const float* ray = &images[0][4 * i];
    const float* hit = &images[1][4 * i];
    score[i] = {.ray = {.u = ray[0], .v = ray[1], .slope_u = ray[2], .slope_v = ray[3]},
                .t = hit[0],
                .status = hit[1],
                .taps = hit[2],
                .steps = hit[3]};
  }
  return score;
}

std::vector<std::uint8_t> OpenglBackend::read_color() {
  if (color_.width == 0) fail_environment("OpenGL: no color frame was drawn");
  context_.make_current();
  std::vector<std::uint8_t> color(static_cast<std::size_t>(color_.width) * static_cast<std::size_t>(color_.height) * 4);
  glGetTextureImage(color_.textures[0], 0, GL_RGBA, GL_UNSIGNED_BYTE, static_cast<GLsizei>(color.size()), color.data());
  check_gl("read the color frame");
  return color;
}

/// The displays on which a context can be made, numbered as --device takes them.
std::vector<UsableDevice> usable_devices() {
  std::vector<UsableDevice> devices;
  for (EGLDisplay display : egl_displays()) {
    try {
      const EglContext context(display, false);
      devices.push_back({.display = display, .info = describe(static_cast<int>(devices.size()))});
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

std::unique_ptr<Backend> open_opengl(int device_index, const BackendOptions& options) {
  const std::vector<UsableDevice> devices = usable_devices();
  if (device_index < 0 || static_cast<std::size_t>(device_index) >= devices.size())
    fail_environment("opengl: no device {}, this machine has {}", device_index, devices.size());
  return std::make_unique<OpenglBackend>(devices[static_cast<std::size_t>(device_index)], options);
}

}  // namespace reliefbench
