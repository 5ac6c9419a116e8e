//===- Comparison.cpp - Whether two pictures are the same -----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Comparison.h"

#include "Piko/Scene/ImageFile.h"

#include <png.h>

#include <cstdlib>

using namespace piko;
using namespace piko::peer;

render::Result<render::Image> peer::readPNG(const std::string &path) {
  auto fail = [&](const std::string &why) {
    return render::Error{"cannot read image '" + path + "': " + why};
  };
  png_image file = {};
  file.version = PNG_IMAGE_VERSION;
  if (!png_image_begin_read_from_file(&file, path.c_str()))
    return fail(file.message);
  if (file.format & PNG_FORMAT_FLAG_LINEAR) {
    png_image_free(&file);
    return fail("expected 8 bits for each channel, but it has 16");
  }
  file.format = PNG_FORMAT_RGBA;
  std::vector<uint8_t> bytes(PNG_IMAGE_SIZE(file));
  if (!png_image_finish_read(&file, /*background=*/nullptr, bytes.data(),
                             /*row_stride=*/0, /*colormap=*/nullptr))
    return fail(file.message);
  render::Image image{int(file.width), int(file.height), {}};
  image.pixels.resize(bytes.size() / 4);
  for (size_t i = 0; i < bytes.size(); ++i)
    image.pixels[i / 4].rgba[int(i % 4)] = float(bytes[i]) / 255.0f;
  return image;
}

Comparison peer::compare(const render::Image &reference,
                         const render::Image &image) {
  Comparison result;
  for (size_t i = 0; i < image.pixels.size(); ++i) {
    int most = 0;
    for (int channel = 0; channel < 3; ++channel)
      most = std::max(
          most, std::abs(render::toByte(reference.pixels[i].rgba[channel]) -
                         render::toByte(image.pixels[i].rgba[channel])));
    result.differing += most > tolerance;
    result.largest = std::max(result.largest, most);
  }
  return result;
}
