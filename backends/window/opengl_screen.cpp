// epoxy goes first: it stands in for the system's GL headers.
#include <epoxy/egl.h>
#include <epoxy/gl.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#define GLFW_EXPOSE_NATIVE_EGL
#define GLFW_NATIVE_INCLUDE_NONE
#include <GLFW/glfw3native.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cstddef>

#include "backends/opengl/egl.h"
#include "backends/opengl/opengl_backend.h"
#include "backends/opengl/opengl_objects.h"
#include "backends/shader_compiler.h"
#include "backends/window/panel_mesh.h"
#include "backends/window/screen.h"

namespace reliefbench {
namespace {

EglContext::Borrowed context_of(const Window& window) {
  return {.display = glfwGetEGLDisplay(),
          .surface = glfwGetEGLSurface(window.handle()),
          .context = glfwGetEGLContext(window.handle())};
}

struct OpenglPicture final : ScreenPicture {
  OpenglPicture(const EglContext& context, int width, int height)
      : ScreenPicture(width, height),
        black(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 4),
        texture(context, {.width = width,
                          .height = height,
                          .layout = {.type = TexelType::unorm8, .channels = 4},
                          .texels = black,
                          .wrap = Wrap::clamp,
                          .filter = Filter::nearest}) {
    black = {};
  }
  std::vector<std::byte> black;  ///< while it is made
  OpenglTexture texture;
};

class OpenglScreen final : public Screen {
 public:
  OpenglScreen(const Window& window, Backend& backend)
      : window_(window),
        backend_(backend),
        context_(context_of(window)),
        vertex_(compile_panel(PanelStage::vertex, Dialect::opengl)),
        fragment_(compile_panel(PanelStage::fragment, Dialect::opengl)),
        program_(context_, "panel",
                 std::array{OpenglProgram::Stage{.kind = GL_VERTEX_SHADER, .spirv = vertex_},
                            OpenglProgram::Stage{.kind = GL_FRAGMENT_SHADER, .spirv = fragment_}},
                 {}) {
    glCreateVertexArrays(1, &corners_);
    glCreateBuffers(static_cast<GLsizei>(buffers_.size()), buffers_.data());
    glVertexArrayVertexBuffer(corners_, 0, buffers_[0], 0, sizeof(PanelVertex));
    glVertexArrayElementBuffer(corners_, buffers_[1]);
    attribute(0, 2, GL_FLOAT, GL_FALSE, offsetof(PanelVertex, x));
    attribute(1, 2, GL_FLOAT, GL_FALSE, offsetof(PanelVertex, u));
    attribute(2, 4, GL_UNSIGNED_BYTE, GL_TRUE, offsetof(PanelVertex, color));
    glfwMakeContextCurrent(window.handle());  // GLFW, too, knows it as current then
    glfwSwapInterval(1);
    check_gl("set up the window");
    glyphs_ = make_glyphs(*this);
  }
  ~OpenglScreen() override {
    if (!context_.can_free()) return;
    glDeleteVertexArrays(1, &corners_);
    glDeleteBuffers(static_cast<GLsizei>(buffers_.size()), buffers_.data());
  }
  OpenglScreen(const OpenglScreen&) = delete;
  OpenglScreen& operator=(const OpenglScreen&) = delete;

  [[nodiscard]] std::unique_ptr<ScreenPicture> make_picture(int width_px, int height_px) override {
    context_.make_current();
    return std::make_unique<OpenglPicture>(context_, width_px, height_px);
  }

  void keep(ScreenPicture& into) override {
    context_.make_current();
    const std::optional<GLuint> drawn = texture_in_window(backend_);
    if (!drawn) {
      backend_.read_color(read_);
      return fill(into, read_);
    }
    glCopyImageSubData(*drawn, GL_TEXTURE_2D, 0, 0, 0, 0, texture_of(into), GL_TEXTURE_2D, 0, 0, 0, 0, into.width_px,
                       into.height_px, 1);
    check_gl("keep a frame");
  }

  void fill(ScreenPicture& into, std::span<const std::uint8_t> rgba8) override {
    context_.make_current();
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTextureSubImage2D(texture_of(into), 0, 0, 0, into.width_px, into.height_px, GL_RGBA, GL_UNSIGNED_BYTE,
                        rgba8.data());
    check_gl("fill a picture");
  }

  void present(const ImDrawData& drawn, SeenWindow* seen) override {
    context_.make_current();
    const Size size = window_.size();
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glViewport(0, 0, size.width, size.height);
    glClear(GL_COLOR_BUFFER_BIT);
    draw(panel_mesh(drawn, false), size);
    if (seen != nullptr) *seen = {.size = size, .rgba8 = read(size)};
    glfwSwapBuffers(window_.handle());
    check_gl("show a frame");
  }

 private:
  static GLuint texture_of(const ScreenPicture& picture) {
    return static_cast<const OpenglPicture&>(picture).texture.id();
  }
  void attribute(GLuint place, GLint numbers, GLenum type, GLboolean is_normalised, std::size_t offset) const {
    glEnableVertexArrayAttrib(corners_, place);
    glVertexArrayAttribFormat(corners_, place, numbers, type, is_normalised, static_cast<GLuint>(offset));
    glVertexArrayAttribBinding(corners_, place, 0);
  }

  void draw(const PanelMesh& mesh, Size size) const {
    const auto load = [](GLuint buffer, const auto& list) {
      glNamedBufferData(buffer, static_cast<GLsizeiptr>(list.size() * sizeof(list[0])), list.data(), GL_STREAM_DRAW);
    };
    load(buffers_[0], mesh.vertices);
    load(buffers_[1], mesh.indices);
    glUseProgram(program_.id());
    glBindVertexArray(corners_);
    glDisable(GL_DEPTH_TEST);
    glEnable(GL_BLEND);
    glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    glEnable(GL_SCISSOR_TEST);
    for (const PanelPart& part : mesh.parts) {
      glScissor(part.left_px, size.height - part.top_px - part.height_px, part.width_px, part.height_px);
      glBindTextureUnit(0, texture_of(*part.picture));
      glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(part.count), GL_UNSIGNED_INT,
                     // NOLINTNEXTLINE(performance-no-int-to-ptr): OpenGL's own way to take an offset
                     reinterpret_cast<const void*>(std::size_t{part.first} * sizeof(mesh.indices[0])));
    }
    // The backend sets what it needs but for these two.
    glDisable(GL_SCISSOR_TEST);
    glDisable(GL_BLEND);
  }

  /// The window, rows from the top.
  static std::vector<std::uint8_t> read(Size size) {
    const auto row = static_cast<std::size_t>(size.width) * 4;
    std::vector<std::uint8_t> upwards(row * static_cast<std::size_t>(size.height));
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glReadPixels(0, 0, size.width, size.height, GL_RGBA, GL_UNSIGNED_BYTE, upwards.data());
    std::vector<std::uint8_t> downwards;
    downwards.reserve(upwards.size());
    for (std::size_t end = upwards.size(); end > 0; end -= row)
      downwards.insert(downwards.end(), upwards.begin() + static_cast<std::ptrdiff_t>(end - row),
                       upwards.begin() + static_cast<std::ptrdiff_t>(end));
    for (std::size_t i = 3; i < downwards.size(); i += 4) downwards[i] = 255;
    return downwards;
  }

  const Window& window_;
  Backend& backend_;
  EglContext context_;
  Spirv vertex_;
  Spirv fragment_;
  OpenglProgram program_;
  GLuint corners_ = 0;
  std::array<GLuint, 2> buffers_{};  ///< vertices, indices
  std::vector<std::uint8_t> read_;
  std::unique_ptr<ScreenPicture> glyphs_;
};

}  // namespace

std::unique_ptr<Backend> open_in_opengl_window(const Window& window, const BackendOptions& options) {
  return open_opengl_in(context_of(window), options);
}

std::unique_ptr<Screen> make_opengl_screen(const Window& window, Backend& backend) {
  return std::make_unique<OpenglScreen>(window, backend);
}

}  // namespace reliefbench
