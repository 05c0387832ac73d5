#pragma once
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "kernels/base/error.h"
#include "kernels/maps/texel.h"

namespace reliefbench {

/// What a test writes: height x width x channels values, stored as `type`.
struct TestImage {
  int width;
  int height;
  int channels;
  TexelType type;
  std::vector<float> pixels;
};

/// Writes it as the extension says: png (8 or 16 bits), tif (8, 16 bits or floats), exr (floats), and with 8 bits tga,
/// webp (lossless), pgm, ppm.
void write_image(const std::filesystem::path& path, const TestImage& image);

/// Values 0, 1, 2, ... of `codes` codes, each as code / (codes - 1), repeated.
[[nodiscard]] std::vector<float> code_ramp(std::size_t count, int codes);

[[nodiscard]] std::string read_bytes(const std::filesystem::path& path);
void write_bytes(const std::filesystem::path& path, const std::string& bytes);

/// The message of the Error(bad_input) that `call` throws; it must be one line, and nothing may reach stderr.
template <typename Call>
std::string input_error(const Call& call) {
  ::testing::internal::CaptureStderr();
  std::string message;
  try {
    call();
    ADD_FAILURE() << "no error was thrown";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Exit::bad_input);
    message = error.what();
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  return message;
}

}  // namespace reliefbench
