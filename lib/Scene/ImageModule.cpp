//===- ImageModule.cpp - Images in files with OpenImageIO -----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "ImageModule.h"

#include <OpenImageIO/imageio.h>

#include <string_view>

using namespace piko;
using namespace piko::render;

namespace {

std::unique_ptr<OIIO::ImageOutput> openFormat(const std::string &extension) {
  auto output = OIIO::ImageOutput::create("image." + extension);
  if (!output)
    OIIO::geterror(); // its text speaks of plugins
  return output;
}

bool hasFormat(const std::string &extension) {
  return openFormat(extension) != nullptr;
}

Result<Done> write(const std::string &file, int width, int height,
                   std::span<const scene::Color> pixels) {
  std::string format = extensionOf(file);
  auto output = openFormat(format);
  if (!output)
    return Error{"no image format has the extension '" + format + "'"};
  bool isFloat = format == "exr" || format == "hdr" || format == "pfm";
  int channels = format == "exr" ? 4 : 3;
  OIIO::TypeDesc type = isFloat ? OIIO::TypeDesc::FLOAT : OIIO::TypeDesc::UINT8;
  OIIO::ImageSpec spec(width, height, channels, type);
  // These would hold the present date, and files of equal pictures differ.
  if (std::string_view writer = output->format_name();
      writer == "openexr" || writer == "tiff")
    spec.attribute("DateTime", "1970:01:01 00:00:00");
  if (!output->open(file, spec))
    return Error{output->geterror()};
  bool ok;
  if (isFloat)
    ok = output->write_image(OIIO::TypeDesc::FLOAT, pixels.data(),
                             sizeof(scene::Color));
  else
    ok = output->write_image(OIIO::TypeDesc::UINT8, toBytes(pixels).data());
  std::string why = ok ? "" : output->geterror();
  if (!output->close() && ok) {
    ok = false;
    why = output->geterror();
  }
  if (!ok)
    return Error{why};
  return Done{};
}

Result<Image> read(const std::string &path) {
  auto input = OIIO::ImageInput::open(path);
  if (!input)
    return Error{OIIO::geterror()};
  const OIIO::ImageSpec &spec = input->spec();
  constexpr int64_t mostPixels = int64_t(1) << 30;
  int channels = spec.nchannels;
  if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || channels < 1 ||
      int64_t(spec.width) * spec.height > mostPixels)
    return Error{"expected a picture of up to 2^30 pixels"};
  std::vector<float> values(size_t(spec.width) * spec.height * channels);
  if (!input->read_image(0, 0, 0, channels, OIIO::TypeDesc::FLOAT,
                         values.data()))
    return Error{input->geterror()};
  Image image{spec.width, spec.height, {}};
  image.pixels.resize(size_t(spec.width) * spec.height);
  int colors = channels < 3 ? 1 : 3;
  for (size_t i = 0; i < image.pixels.size(); ++i) {
    const float *pixel = &values[i * size_t(channels)];
    for (int c = 0; c < 3; ++c)
      image.pixels[i].rgba[c] = pixel[colors == 1 ? 0 : c];
    image.pixels[i].rgba.a = channels > colors ? pixel[colors] : 1;
  }
  return image;
}

} // namespace

extern "C" __attribute__((visibility("default")))
const ImageFunctions piko_image_functions = {hasFormat, write, read};
