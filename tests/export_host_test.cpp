// Small programs that do what the README.md of an export says, with its files alone, and show the relief: OpenGL
// through EGL, Vulkan, and a WebGPU page; and the suite's own Vulkan. To be looked at: build/screenshots/export_*.png.
#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>
#include <span>

#include "kernels/image/image.h"
#include "kernels/image/ktx2.h"
#include "tests/browser.h"
#include "tests/command.h"
#include "tests/raw_vulkan.h"
#include "tests/technique_rig.h"

namespace reliefbench {
namespace {

constexpr int kWidth_px = 320;
constexpr int kHeight_px = 240;
using Rgba8 = std::vector<std::uint8_t>;  // RGBA8, rows from the bottom

/// A plane that fills the frame, seen by an eye over it: one triangle is enough.
constexpr std::string_view kPlaneVertex = R"(
layout(location = 0) out vec2 uv;
layout(location = 1) out vec3 view_ts;
layout(location = 2) out vec3 light_ts;
void main() {
  uv = vec2(INDEX == 1 ? 16.0 : -8.0, INDEX == 2 ? 16.0 : -8.0);
  vec3 eye = vec3(0.5, 0.0, 1.0);
  vec3 forward = normalize(vec3(0.5, 0.8, 0.0) - eye);
  vec3 right = vec3(1.0, 0.0, 0.0);
  view_ts = vec3(uv, 0.0) - eye;
  light_ts = vec3(0.6, 0.3, 0.7);
  gl_Position = vec4(dot(view_ts, right) * 1.5, dot(view_ts, cross(right, forward)) * 2.0, 0.0, dot(view_ts, forward));
}
)";

/// The export's README.md, followed with OpenGL alone.
class RawOpenGl {
 public:
  RawOpenGl() {
    display_ = eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
    eglInitialize(display_, nullptr, nullptr);
    eglBindAPI(EGL_OPENGL_API);
    constexpr EGLint kVersion[] = {EGL_CONTEXT_MAJOR_VERSION, 4, EGL_CONTEXT_MINOR_VERSION, 5, EGL_NONE};
    context_ = eglCreateContext(display_, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, kVersion);
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_);
  }
  ~RawOpenGl() {
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(display_, context_);
  }
  RawOpenGl(const RawOpenGl&) = delete;
  RawOpenGl& operator=(const RawOpenGl&) = delete;

  static Rgba8 draw(const Ktx2File& map, const std::string& fragment) {
    // 1. Upload the texture as it is. 2. Its sampler.
    GLuint texture = 0;
    glCreateTextures(GL_TEXTURE_2D, 1, &texture);
    glTextureStorage2D(texture, 1, GL_RG8, map.image.width, map.image.height);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTextureSubImage2D(texture, 0, 0, 0, map.image.width, map.image.height, GL_RG, GL_UNSIGNED_BYTE,
                        map.image.texels.data());
    glTextureParameteri(texture, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_NEAREST);
    glTextureParameteri(texture, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTextureParameteri(texture, GL_TEXTURE_WRAP_S, GL_REPEAT);
    glTextureParameteri(texture, GL_TEXTURE_WRAP_T, GL_REPEAT);
    glBindTextureUnit(0, texture);
    // The example binds it at 0, and wants uv, view_ts and light_ts.
    const GLuint program = glCreateProgram();
    add(program, GL_VERTEX_SHADER, "#version 450\n#define INDEX gl_VertexID\n" + std::string(kPlaneVertex));
    add(program, GL_FRAGMENT_SHADER, fragment);
    glLinkProgram(program);
    glUseProgram(program);
    GLuint target = 0;
    GLuint frame = 0;
    GLuint array = 0;
    glCreateRenderbuffers(1, &target);
    glNamedRenderbufferStorage(target, GL_RGBA8, kWidth_px, kHeight_px);
    glCreateFramebuffers(1, &frame);
    glNamedFramebufferRenderbuffer(frame, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, target);
    glCreateVertexArrays(1, &array);
    glBindFramebuffer(GL_FRAMEBUFFER, frame);
    glBindVertexArray(array);
    glViewport(0, 0, kWidth_px, kHeight_px);
    glClear(GL_COLOR_BUFFER_BIT);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    Rgba8 picture(std::size_t{kWidth_px} * kHeight_px * 4);
    glReadPixels(0, 0, kWidth_px, kHeight_px, GL_RGBA, GL_UNSIGNED_BYTE, picture.data());
    EXPECT_EQ(glGetError(), GLenum{GL_NO_ERROR});
    return picture;
  }

 private:
  static void add(GLuint program, GLenum stage, const std::string& text) {
    const GLuint shader = glCreateShader(stage);
    const char* const data = text.c_str();
    glShaderSource(shader, 1, &data, nullptr);
    glCompileShader(shader);
    GLint is_compiled = 0;
    glGetShaderiv(shader, GL_COMPILE_STATUS, &is_compiled);
    std::string log(1024, '\0');
    if (is_compiled == 0) glGetShaderInfoLog(shader, 1024, nullptr, log.data());
    EXPECT_NE(is_compiled, 0) << log;
    glAttachShader(program, shader);
  }
  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
};

/// The same in a page; the picture comes back as a data attribute, two digits a byte of red.
constexpr std::string_view kPage = R"(<body><script>HOLD
const put = document.body.dataset;
const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
(async () => {
  const adapter = await navigator.gpu?.requestAdapter();
  if (!adapter) { put.adapter = 'none'; return; }
  const device = await adapter.requestDevice();
  const texture = device.createTexture({size: [files.width, files.height], format: 'rg8unorm',
      usage: GPUTextureUsage.TEXTURE_BINDING | GPUTextureUsage.COPY_DST});
  device.queue.writeTexture({texture}, bytes(files.texels), {bytesPerRow: 2 * files.width}, [files.width, files.height]);
  const sampler = device.createSampler({magFilter: 'linear', minFilter: 'linear', addressModeU: 'repeat',
      addressModeV: 'repeat'});
  const vertex = device.createShaderModule({code: `
struct Out { @builtin(position) p: vec4f, @location(0) uv: vec2f, @location(1) view_ts: vec3f, @location(2) light: vec3f }
@vertex fn main(@builtin(vertex_index) i: u32) -> Out {
  let uv = vec2f(select(-8.0, 16.0, i == 1), select(-8.0, 16.0, i == 2));
  let eye = vec3f(0.5, 0.0, 1.0);
  let forward = normalize(vec3f(0.5, 0.8, 0.0) - eye);
  let right = vec3f(1.0, 0.0, 0.0);
  let v = vec3f(uv, 0.0) - eye;
  return Out(vec4f(dot(v, right) * 1.5, dot(v, cross(right, forward)) * 2.0, 0.0, dot(v, forward)), uv, v,
             vec3f(0.6, 0.3, 0.7));
}`});
  const pipeline = device.createRenderPipeline({layout: 'auto', vertex: {module: vertex},
      fragment: {module: device.createShaderModule({code: files.shader}), targets: [{format: 'rgba8unorm'}]}});
  const [width, height] = [320, 240];
  const target = device.createTexture({size: [width, height], format: 'rgba8unorm',
      usage: GPUTextureUsage.RENDER_ATTACHMENT | GPUTextureUsage.COPY_SRC});
  const buffer = device.createBuffer({size: 4 * width * height, usage: GPUBufferUsage.COPY_DST | GPUBufferUsage.MAP_READ});
  const encoder = device.createCommandEncoder();
  const pass = encoder.beginRenderPass({colorAttachments: [{view: target.createView(), loadOp: 'clear', storeOp: 'store'}]});
  pass.setPipeline(pipeline);
  pass.setBindGroup(0, device.createBindGroup({layout: pipeline.getBindGroupLayout(0), entries: [
      {binding: 0, resource: texture.createView()}, {binding: 2, resource: sampler}]}));
  pass.draw(3);
  pass.end();
  encoder.copyTextureToBuffer({texture: target}, {buffer, bytesPerRow: 4 * width}, [width, height]);
  device.queue.submit([encoder.finish()]);
  await buffer.mapAsync(GPUMapMode.READ);
  const red = new Uint8Array(buffer.getMappedRange()).filter((_, i) => i % 4 === 0);
  put.red = Array.from(red, (b) => b.toString(16).padStart(2, '0')).join('');
})().catch((error) => (put.failed = error)).finally(() => hold.close());
</script>
</body>)";

/// How large a part of two pictures' red differs by more than 4 of 255.
double difference(const Rgba8& a, const Rgba8& b) {
  std::size_t differing = 0;
  for (std::size_t i = 0; i < a.size(); i += 4) differing += std::abs(int{a[i]} - int{b[i]}) > 4 ? 1 : 0;
  return static_cast<double>(differing) / (static_cast<double>(a.size()) / 4);
}

void leave(const Rgba8& picture, const std::string& name) {
  const std::filesystem::path folder = std::filesystem::path(RELIEFBENCH_SOURCE_DIR) / "build" / "screenshots";
  std::filesystem::create_directories(folder);
  Rgba8 rows;
  for (std::size_t y = kHeight_px; y-- > 0;) {
    const auto row = picture.begin() + static_cast<std::ptrdiff_t>(y * kWidth_px * 4);
    rows.insert(rows.end(), row, row + std::ptrdiff_t{kWidth_px} * 4);
  }
  const std::vector<std::uint8_t> png = encode_png(kWidth_px, kHeight_px, rows);
  std::ofstream(folder / name, std::ios::binary)
      .write(reinterpret_cast<const char*>(png.data()), static_cast<std::streamsize>(png.size()));
}

class ExportHosts : public InBrowser {
 protected:
  void SetUp() override {
    const CommandResult result =
        run_reliefbench({"export", "fbm", "--size", "128x128", "--case", "cone?format=rg8&shadow=cone",
                         "--relief-depth", "0.2", "--language", "glsl,wgsl,spirv", "-o", "out"},
                        folder_.path());
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }
  [[nodiscard]] std::string file(const std::string& name) const { return file_text(folder_ / "out" / name); }

  /// Words of the plane's vertex shader and of the exported fragment shader.
  [[nodiscard]] std::array<Spirv, 2> stages() const {
    const std::string vertex = (folder_ / "plane.vert").string();
    std::ofstream(vertex) << "#version 450\n#define INDEX gl_VertexIndex\n" << kPlaneVertex;
    EXPECT_EQ(std::system(fmt::format("glslangValidator -V '{0}' -o '{0}.spv' >/dev/null", vertex).c_str()), 0);
    const auto words = [](const std::string& bytes) {
      Spirv spirv(bytes.size() / 4);
      std::memcpy(spirv.data(), bytes.data(), bytes.size());
      return spirv;
    };
    return {words(file_text(vertex + ".spv")), words(file("example.spv"))};
  }

  [[nodiscard]] Rgba8 on_vulkan(const Ktx2File& map) const {
    const auto [vertex, fragment] = stages();
    return RawVulkan().draw({.width = static_cast<std::uint32_t>(map.image.width),
                             .height = static_cast<std::uint32_t>(map.image.height),
                             .texels = std::as_bytes(std::span(map.image.texels))},
                            vertex, fragment, kWidth_px, kHeight_px);
  }

  [[nodiscard]] Rgba8 on_suite(const Ktx2File& map) const {
    const Rig rig(find_backend("vulkan"), 0);
    const auto [vertex, fragment] = stages();
    const auto pipeline = rig.backend->compile(
        {.label = "example", .vertex = vertex, .fragment = fragment, .constants = {}, .target = Target::color});
    const auto texture = rig.backend->upload(texture_desc(map.image, Wrap::repeat));
    Scene scene = kScene;
    scene.width_px = kWidth_px;
    scene.height_px = kHeight_px;
    rig.backend->render({.pipeline = pipeline.get(),
                         .textures = {{"bound_relief_map", texture.get()}},
                         .frame = frame_uniforms(scene, 128, 128)},
                        1, Timer::fenced_wall);
    EXPECT_THAT(rig.backend->debug_messages(), testing::IsEmpty());
    return rig.backend->read_color();
  }

  [[nodiscard]] Rgba8 in_page(const Ktx2File& map) const {
    const std::string texels(reinterpret_cast<const char*>(map.image.texels.data()), map.image.texels.size());
    std::ofstream(folder_ / "texels", std::ios::binary) << texels;
    const nlohmann::json files = {{"width", map.image.width},
                                  {"height", map.image.height},
                                  {"texels", output_of(fmt::format("base64 -w 0 '{}'", (folder_ / "texels").string()))},
                                  {"shader", file("example.wgsl")}};
    std::string page = "<script>const files = " + files.dump() + ";</script>" + std::string(kPage);
    page.replace(page.find("HOLD"), 4, kHold);
    const std::string body = body_tag(document(page, "", {.with_webgpu = true}));
    const std::size_t begin = body.find("data-red=\"");
    EXPECT_NE(begin, std::string::npos) << body.substr(0, 300);
    Rgba8 picture(std::size_t{kWidth_px} * kHeight_px * 4);
    for (std::size_t y = 0; begin != std::string::npos && y < kHeight_px; ++y)  // rows from the top there
      for (std::size_t x = 0; x < kWidth_px; ++x)
        picture[(y * kWidth_px + x) * 4] = picture[(y * kWidth_px + x) * 4 + 1] = picture[(y * kWidth_px + x) * 4 + 2] =
            static_cast<std::uint8_t>(
                std::stoi(body.substr(begin + 10 + 2 * ((kHeight_px - 1 - y) * kWidth_px + x), 2), nullptr, 16));
    for (std::size_t i = 3; i < picture.size(); i += 4) picture[i] = 255;
    return picture;
  }
};

TEST_F(ExportHosts, show_the_same_relief) {
  const Ktx2File map = read_ktx2(folder_ / "out/relief.ktx2");
  const Rgba8 on_opengl = RawOpenGl().draw(map, file("example.frag"));
  leave(on_opengl, "export_opengl.png");
  std::size_t lit = 0;
  for (std::size_t i = 0; i < on_opengl.size(); i += 4) lit += on_opengl[i] > 60 ? 1 : 0;
  const std::size_t pixels = on_opengl.size() / 4;
  EXPECT_GT(lit, pixels / 4);  // there is light, and there is shadow
  EXPECT_LT(lit, pixels * 9 / 10);
  const Rgba8 from_spirv = on_vulkan(map);
  leave(from_spirv, "export_vulkan.png");
  EXPECT_LT(difference(on_opengl, from_spirv), 0.01);
  EXPECT_EQ(difference(on_suite(map), from_spirv), 0);  // one driver, one module
  if (!Chromium::is_installed()) GTEST_SKIP() << "chromium is not installed";
  const Rgba8 of_page = in_page(map);
  leave(of_page, "export_webgpu.png");
  EXPECT_LT(difference(on_opengl, of_page), 0.05);  // SwiftShader's filter is not llvmpipe's
}

// The library in a host's own shader: bits of the heights that are hit, from uv that are whole multiples of 2^-7.
TEST_F(ExportHosts, find_the_same_heights_a_thousand_tiles_away) {
  const Ktx2File map = read_ktx2(folder_ / "out/relief.ktx2");
  const auto heights = [&](double tiles) {
    return RawOpenGl().draw(map, "#version 450\n" + file("relief.glsl") +
                                     fmt::format(R"(
layout(binding = 0) uniform sampler2D map;
layout(location = 0) out vec4 bits;
void main() {{
  vec2 uv = gl_FragCoord.xy / 64.0;
  ReliefSurface surface =
      relief_trace(map, uv + {:#}, vec3(uv - 2.5, -1.0), 0.125, vec3(0.6, 0.0, 0.8), 0.0);
  bits = unpackUnorm4x8(floatBitsToUint(surface.height + surface.shadow));
}}
)",
                                                 tiles));
  };
  const Rgba8 near = heights(0);
  EXPECT_GT(std::set<std::uint8_t>(near.begin(), near.end()).size(), 100U);
  EXPECT_EQ(near, heights(1000));
  EXPECT_EQ(near, heights(-1000));
}

}  // namespace
}  // namespace reliefbench
