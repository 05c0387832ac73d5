#include "backends/spirv.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "backends/shader_compiler.h"
#include "kernels/base/error.h"

namespace reliefbench {
namespace {

using ::testing::IsEmpty;

TEST(Spirv, declared_constants_are_listed_with_their_names) {
  for (const Dialect dialect : {Dialect::opengl, Dialect::vulkan}) {
    const std::vector<DeclaredConstant> load = declared_constants(compile_load(dialect));
    ASSERT_EQ(load.size(), 1u);
    EXPECT_EQ(load[0].id, 0u);
    EXPECT_EQ(load[0].name, "LOAD_STEPS");
    EXPECT_THAT(declared_constants(compile_vertex(dialect)), IsEmpty());
  }
}

TEST(Spirv, a_broken_module_is_refused) {
  Spirv spirv = compile_load(Dialect::vulkan);
  EXPECT_THROW((void)declared_constants(std::span(spirv).first(3)), Error);
  spirv[5] = 0;  // an instruction of no words
  EXPECT_THROW((void)declared_constants(spirv), Error);
}

}  // namespace
}  // namespace reliefbench
