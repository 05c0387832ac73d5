#pragma once
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "kernels/base/error.h"

namespace reliefbench {

/// What a test writes: height x width x channels values, stored as `type`.
struct TestImage {
  int width;
  int height;
  int channels;
  OIIO::TypeDesc type;
  std::vector<float> pixels;
};

inline void write_image(const std::filesystem::path& path, const TestImage& image) {
  OIIO::ImageSpec spec(image.width, image.height, image.channels, image.type);
  spec["oiio:UnassociatedAlpha"] = 1;
  const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(path.string());
  ASSERT_TRUE(output) << OIIO::geterror();
  ASSERT_TRUE(output->open(path.string(), spec)) << output->geterror();
  ASSERT_TRUE(output->write_image(OIIO::TypeDesc::FLOAT, image.pixels.data())) << output->geterror();
  ASSERT_TRUE(output->close()) << output->geterror();
}

/// Values 0, 1, 2, ... of `codes` codes, each as code / (codes - 1), repeated.
inline std::vector<float> code_ramp(std::size_t count, int codes) {
  std::vector<float> values;
  for (std::size_t i = 0; i < count; ++i)
    values.push_back(static_cast<float>(static_cast<int>(i) % codes) / static_cast<float>(codes - 1));
  return values;
}

inline std::string read_bytes(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline void write_bytes(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

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
