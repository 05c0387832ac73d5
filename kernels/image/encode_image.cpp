#include "kernels/image/encode_image.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <memory>

#include "kernels/base/error.h"

namespace reliefbench {
namespace {

OIIO::TypeDesc type_of(TexelType type) {
  constexpr std::array kTypes{OIIO::TypeDesc::UINT8, OIIO::TypeDesc::UINT16, OIIO::TypeDesc::HALF,
                              OIIO::TypeDesc::FLOAT};
  return kTypes.at(static_cast<std::size_t>(type));
}

}  // namespace

std::string encode_image(std::string_view extension, const ImageSource& source) {
  const OIIO::TypeDesc type = type_of(source.type);
  OIIO::ImageSpec spec(source.width, source.height, static_cast<int>(source.channels.size()), type);
  spec.channelnames = source.channels;
  spec["oiio:UnassociatedAlpha"] = 1;
  for (const auto& [key, value] : source.metadata) spec[key] = value;
  const std::string name = fmt::format("memory.{}", extension);
  std::vector<unsigned char> bytes;
  OIIO::Filesystem::IOVecOutput memory(bytes);
  const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(name, &memory);
  const auto fail = [&](std::string text) {
    text.resize(std::min(text.size(), text.find_first_of("\r\n")));
    fail_environment("OpenImageIO cannot write {} of {}x{}: {}", extension, source.width, source.height, text);
  };
  if (!output) fail(OIIO::geterror());
  if (!output->open(name, spec) || !output->write_image(type, source.pixels.data()) || !output->close())
    fail(output->geterror());
  return {bytes.begin(), bytes.end()};
}

}  // namespace reliefbench
