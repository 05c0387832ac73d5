// Pipelines that are kept on disk: only what this driver made of this pipeline comes back, and is drawn with alike.
#include "backends/pipeline_cache.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <map>

#include "backends/shader_compiler.h"
#include "backends/vulkan/vulkan_device.h"
#include "tests/own_cache.h"
#include "tests/temp_folder.h"

namespace reliefbench {
namespace {

using Bytes = std::vector<std::byte>;

class PipelineCacheTest : public ::testing::Test {
 protected:
  TempFolder folder_;
  OwnCache cache_{folder_ / "cache"};
};

TEST_F(PipelineCacheTest, gives_back_what_was_kept_and_nothing_damaged) {
  const PipelineCache cache("a driver 1.0");
  const Bytes bytes(100, std::byte{7});
  EXPECT_FALSE(cache.get("one"));
  cache.put("one", bytes);
  EXPECT_EQ(PipelineCache("a driver 1.0").get("one"), bytes);
  EXPECT_FALSE(cache.get("two"));
  ASSERT_EQ(cache_.files().size(), 1U);
  std::filesystem::resize_file(cache_.files()[0], std::filesystem::file_size(cache_.files()[0]) - 1);
  EXPECT_FALSE(cache.get("one"));
  const PipelineCache none;
  none.put("three", bytes);
  EXPECT_FALSE(none.get("three"));
  EXPECT_EQ(cache_.files().size(), 1U);
}

struct Shaders {
  explicit Shaders(Dialect dialect) : vertex(compile_vertex(dialect)), load(compile_load(dialect)) {}
  [[nodiscard]] PipelineDesc desc(int steps = 3) const {
    return {.label = "load",
            .vertex = vertex,
            .fragment = load,
            .constants = {{.id = 0, .value = steps}},
            .target = Target::color};
  }
  Spirv vertex, load;
};

TEST_F(PipelineCacheTest, a_pipeline_is_told_by_all_that_it_is_made_of) {
  const Shaders shaders(Dialect::vulkan);
  const PipelineCache cache("a driver 1.0");
  const std::string key = cache.key(shaders.desc());
  PipelineDesc named = shaders.desc();
  named.label = "another";
  EXPECT_EQ(cache.key(named), key);
  EXPECT_NE(cache.key(shaders.desc(4)), key);
  PipelineDesc other = shaders.desc();
  other.target.has_depth = true;
  EXPECT_NE(cache.key(other), key);
  other = shaders.desc();
  other.target.attachments[0].layout.type = TexelType::float32;
  EXPECT_NE(cache.key(other), key);
  other = shaders.desc();
  other.vertex = shaders.load;
  EXPECT_NE(cache.key(other), key);
  other = shaders.desc();
  other.fragment = shaders.vertex;
  EXPECT_NE(cache.key(other), key);
  EXPECT_NE(PipelineCache("a driver 1.1").key(shaders.desc()), key);
  EXPECT_EQ(PipelineCache().key(shaders.desc()), "");
}

/// A frame of the pipeline, 8x8.
std::vector<std::uint8_t> picture_of(Backend& backend, const Pipeline& pipeline) {
  Draw draw{.pipeline = &pipeline};
  draw.frame.sizes = {8, 8, 1, 1};
  backend.render(draw, 1, Timer::fenced_wall);
  return backend.read_color();
}

TEST_F(PipelineCacheTest, vulkan_is_given_nothing_but_its_own) {
  if (vulkan_devices().empty()) GTEST_SKIP() << "no Vulkan device on this machine";
  const VulkanDevice device(0, {.keeps_pipelines = true});
  const VkPhysicalDeviceProperties& properties = device.physical().properties;
  const Shaders shaders(Dialect::vulkan);
  VkPipelineCacheHeaderVersionOne header{.headerSize = sizeof(header),
                                         .headerVersion = VK_PIPELINE_CACHE_HEADER_VERSION_ONE,
                                         .vendorID = properties.vendorID,
                                         .deviceID = properties.deviceID};
  std::ranges::copy(properties.pipelineCacheUUID, header.pipelineCacheUUID);
  const auto kept = [](const VkPipelineCacheHeaderVersionOne& with, std::size_t more) {
    Bytes bytes(sizeof(with) + more);
    std::memcpy(bytes.data(), &with, sizeof(with));
    return bytes;
  };
  const auto backend = open_vulkan(0, {.debug = true, .keeps_pipelines = true});
  const std::size_t files = cache_.files().size();  // of SPIR-V
  const std::vector<std::uint8_t> picture = picture_of(*backend, *backend->compile(shaders.desc()));
  const bool is_kept = cache_.files().size() > files;  // lavapipe gives a header alone
  EXPECT_EQ(backend->compile(shaders.desc())->is_from_cache, is_kept);

  const auto is_taken = [&](const Bytes& bytes) {
    device.pipelines().put(device.pipelines().key(shaders.desc()), bytes);
    const auto pipeline = backend->compile(shaders.desc());
    EXPECT_EQ(picture_of(*backend, *pipeline), picture);
    return pipeline->is_from_cache;
  };
  EXPECT_FALSE(is_taken(kept(header, 0))) << "nothing is in it";
  EXPECT_FALSE(is_taken(Bytes(8)));
  const auto with = [&](const auto& change) {
    VkPipelineCacheHeaderVersionOne other = header;
    change(other);
    return kept(other, 16);
  };
  EXPECT_FALSE(is_taken(with([](auto& of) { ++of.pipelineCacheUUID[3]; }))) << "another build of the driver";
  EXPECT_FALSE(is_taken(with([](auto& of) { ++of.vendorID; })));
  EXPECT_FALSE(is_taken(with([](auto& of) { ++of.deviceID; })));
  EXPECT_FALSE(is_taken(with([](auto& of) { of.headerVersion = VkPipelineCacheHeaderVersion(2); })));
  EXPECT_FALSE(is_taken(with([](auto& of) { ++of.headerSize; })));
  EXPECT_TRUE(is_taken(kept(header, 16)));
  EXPECT_FALSE(open_vulkan(0, {})->compile(shaders.desc())->is_from_cache) << "nobody asked for it";
  EXPECT_THAT(backend->debug_messages(), ::testing::IsEmpty());
}

/// Program binaries of an OpenGL that has none, in this process: a binary is the number of a program that was linked
/// before, which is then made again from its shaders.
class ProgramBinaries {
 public:
  ProgramBinaries() {
    ours() = this;
    epoxy_glGetIntegerv = [](GLenum name, GLint* value) {
      real(epoxy_glGetIntegerv, "glGetIntegerv")(name, value);
      if (name == GL_NUM_PROGRAM_BINARY_FORMATS) *value = 1;
    };
    epoxy_glGetString = [](GLenum name) {
      const bool is_mesas = name == GL_VENDOR || name == GL_VERSION;  // whose binaries are not asked for
      return is_mesas ? reinterpret_cast<const GLubyte*>("4.5 test") : real(epoxy_glGetString, "glGetString")(name);
    };
    epoxy_glShaderBinary = [](GLsizei count, const GLuint* shaders, GLenum format, const void* code, GLsizei bytes) {
      const auto* const words = static_cast<const std::uint32_t*>(code);
      ours()->shaders_[shaders[0]].code.assign(words, words + static_cast<std::size_t>(bytes) / 4);
      real(epoxy_glShaderBinary, "glShaderBinary")(count, shaders, format, code, bytes);
    };
    epoxy_glSpecializeShaderARB = [](GLuint shader, const GLchar* entry, GLuint count, const GLuint* ids,
                                     const GLuint* values) {
      ours()->shaders_[shader].ids.assign(ids, ids + count);
      ours()->shaders_[shader].values.assign(values, values + count);
      real(epoxy_glSpecializeShaderARB, "glSpecializeShaderARB")(shader, entry, count, ids, values);
    };
    epoxy_glGetProgramiv = [](GLuint program, GLenum name, GLint* value) {
      real(epoxy_glGetProgramiv, "glGetProgramiv")(program, name, value);
      if (name == GL_PROGRAM_BINARY_LENGTH) *value = sizeof(std::size_t);
    };
    epoxy_glGetProgramBinary = [](GLuint program, GLsizei, GLsizei* size, GLenum* format, void* bytes) {
      std::array<GLuint, 2> shaders{};
      GLsizei count = 0;
      glGetAttachedShaders(program, shaders.size(), &count, shaders.data());
      std::vector<Shader> made;
      for (GLsizei i = 0; i < count; ++i) {
        Shader& shader = ours()->shaders_[shaders.at(static_cast<std::size_t>(i))];
        glGetShaderiv(shaders.at(static_cast<std::size_t>(i)), GL_SHADER_TYPE, &shader.kind);
        made.push_back(shader);
      }
      const std::size_t number = ours()->programs_.size();
      ours()->programs_.push_back(std::move(made));
      std::memcpy(bytes, &number, sizeof(number));
      *size = sizeof(number);
      *format = kFormat;
    };
    epoxy_glProgramBinary = [](GLuint program, GLenum format, const void* bytes, GLsizei size) {
      EXPECT_EQ(format, kFormat);
      EXPECT_EQ(size, static_cast<GLsizei>(sizeof(std::size_t)));
      ++ours()->given_;
      if (ours()->is_refusing_) return;
      std::size_t number = 0;
      std::memcpy(&number, bytes, sizeof(number));
      for (const Shader& made : ours()->programs_.at(number)) {
        const GLuint shader = glCreateShader(static_cast<GLenum>(made.kind));
        glAttachShader(program, shader);
        glDeleteShader(shader);
        real(epoxy_glShaderBinary, "glShaderBinary")(1, &shader, GL_SHADER_BINARY_FORMAT_SPIR_V_ARB, made.code.data(),
                                                     static_cast<GLsizei>(4 * made.code.size()));
        real(epoxy_glSpecializeShaderARB, "glSpecializeShaderARB")(shader, "main", static_cast<GLuint>(made.ids.size()),
                                                                   made.ids.data(), made.values.data());
      }
      glLinkProgram(program);
    };
  }
  ~ProgramBinaries() {
    const auto restore = [](auto*& call, const char* name) { call = real(call, name); };
    restore(epoxy_glGetIntegerv, "glGetIntegerv");
    restore(epoxy_glGetString, "glGetString");
    restore(epoxy_glShaderBinary, "glShaderBinary");
    restore(epoxy_glSpecializeShaderARB, "glSpecializeShaderARB");
    restore(epoxy_glGetProgramiv, "glGetProgramiv");
    restore(epoxy_glGetProgramBinary, "glGetProgramBinary");
    restore(epoxy_glProgramBinary, "glProgramBinary");
    ours() = nullptr;
  }
  ProgramBinaries(const ProgramBinaries&) = delete;
  ProgramBinaries& operator=(const ProgramBinaries&) = delete;

  void refuse() { is_refusing_ = true; }
  [[nodiscard]] int given() const { return given_; }

 private:
  struct Shader {
    GLint kind = 0;
    std::vector<std::uint32_t> code;
    std::vector<GLuint> ids, values;
  };
  static constexpr GLenum kFormat = 0x1234;
  static ProgramBinaries*& ours() {
    static ProgramBinaries* one = nullptr;
    return one;
  }
  template <typename Function>
  static Function real(Function, const char* name) {
    return reinterpret_cast<Function>(eglGetProcAddress(name));
  }

  std::map<GLuint, Shader> shaders_;
  std::vector<std::vector<Shader>> programs_;
  bool is_refusing_ = false;
  int given_ = 0;
};

TEST_F(PipelineCacheTest, opengl_links_a_program_once) {
  if (opengl_devices().empty()) GTEST_SKIP() << "no OpenGL device on this machine";
  const Shaders shaders(Dialect::opengl);
  ProgramBinaries binaries;
  const auto compiled = [&](int steps, bool keeps) {
    const auto backend = open_opengl(0, {.debug = true, .keeps_pipelines = keeps});
    const auto pipeline = backend->compile(shaders.desc(steps));
    return std::pair(pipeline->is_from_cache, picture_of(*backend, *pipeline));
  };
  const auto [is_known, picture] = compiled(3, true);
  EXPECT_FALSE(is_known);
  EXPECT_EQ(binaries.given(), 0);
  EXPECT_EQ(compiled(3, true), std::pair(true, picture));
  EXPECT_EQ(binaries.given(), 1);
  const auto [is_other_known, other] = compiled(4, true);
  EXPECT_FALSE(is_other_known);
  EXPECT_NE(other, picture);
  EXPECT_EQ(compiled(4, true), std::pair(true, other));
  EXPECT_EQ(compiled(3, false), std::pair(false, picture));
  EXPECT_EQ(binaries.given(), 2);
  for (const std::filesystem::path& file : cache_.files()) std::filesystem::resize_file(file, 80);
  EXPECT_EQ(compiled(3, true), std::pair(false, picture)) << "a damaged file";
  EXPECT_EQ(binaries.given(), 2);
  for (const std::filesystem::path& file : cache_.files()) std::filesystem::remove(file);
  const DeviceInfo device = opengl_devices().front();
  const PipelineCache died(fmt::format("opengl {} {} {}", device.vendor, device.name, device.driver));
  died.put(died.key(shaders.desc(5)), {});
  for (int again = 0; again < 2; ++again) EXPECT_FALSE(compiled(5, true).first) << "a driver that died over it";
  EXPECT_EQ(compiled(3, true), std::pair(false, picture));
  EXPECT_EQ(binaries.given(), 2);
  binaries.refuse();
  EXPECT_EQ(compiled(3, true), std::pair(false, picture)) << "the driver was changed";
  EXPECT_EQ(binaries.given(), 3);
}

}  // namespace
}  // namespace reliefbench
