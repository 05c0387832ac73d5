// What is OpenGL's own; what holds for every backend is in backend_test.cpp.
#include <gtest/gtest.h>

#include "backends/opengl/egl.h"
#include "backends/opengl/opengl_objects.h"

namespace reliefbench {
namespace {

TEST(OpenGl, faults_are_told_by_their_codes) {
  EXPECT_EQ(fault_of_gl(GL_CONTEXT_LOST, GL_NO_ERROR), Fault::device_lost);
  EXPECT_EQ(fault_of_gl(GL_NO_ERROR, GL_GUILTY_CONTEXT_RESET), Fault::device_lost);
  EXPECT_EQ(fault_of_gl(GL_INVALID_OPERATION, GL_UNKNOWN_CONTEXT_RESET), Fault::device_lost);
  EXPECT_EQ(fault_of_gl(GL_OUT_OF_MEMORY, GL_NO_ERROR), Fault::out_of_memory);
  EXPECT_EQ(fault_of_gl(GL_INVALID_OPERATION, GL_NO_ERROR), Fault::other);
  EXPECT_EQ(fault_of_egl(EGL_CONTEXT_LOST), Fault::device_lost);
  EXPECT_EQ(fault_of_egl(EGL_BAD_ALLOC), Fault::out_of_memory);
  EXPECT_EQ(fault_of_egl(EGL_BAD_MATCH), Fault::other);
}

}  // namespace
}  // namespace reliefbench
