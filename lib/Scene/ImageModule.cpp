//===- ImageModule.cpp - Images in files with OpenImageIO -----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "ImageModule.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string_view>
#include <unistd.h>
#include <vector>

using namespace piko;
using namespace piko::render;
namespace fs = std::filesystem;

namespace {

Error failTo(const char *what, const std::string &path, std::string why) {
  if (size_t end = why.find('\n'); end != std::string::npos)
    why.resize(end);
  return {std::string("cannot ") + what + " image '" + path + "': " + why};
}

Error failWith(const std::string &path, std::string why) {
  return failTo("write", path, std::move(why));
}

/// The extension, in lowercase and without the dot.
std::string extensionOf(const std::string &path) {
  std::string extension = fs::path(path).extension().string();
  if (!extension.empty())
    extension.erase(0, 1);
  for (char &c : extension)
    c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

Result<std::unique_ptr<OIIO::ImageOutput>> openFormat(const std::string &path) {
  std::string extension = extensionOf(path);
  if (extension.empty())
    return failWith(path,
                    "expected a name that ends in a format, such as .png");
  if (auto output = OIIO::ImageOutput::create("image." + extension))
    return output;
  OIIO::geterror(); // its text speaks of plugins
  return failWith(path,
                  "no image format has the extension '" + extension + "'");
}

std::vector<uint8_t> toBytes(std::span<const scene::Color> pixels) {
  std::vector<uint8_t> bytes;
  bytes.reserve(pixels.size() * 3);
  for (const scene::Color &pixel : pixels)
    for (int channel = 0; channel < 3; ++channel)
      bytes.push_back(toByte(pixel.rgba[channel]));
  return bytes;
}

/// Removes a file unless it was renamed before.
struct TemporaryFile {
  fs::path path;
  ~TemporaryFile() {
    std::error_code ignored;
    fs::remove(path, ignored);
  }
};

Result<Done> writeTo(OIIO::ImageOutput &output, const std::string &path,
                     const std::string &file, int width, int height,
                     std::span<const scene::Color> pixels) {
  std::string format = extensionOf(path);
  bool isFloat = format == "exr" || format == "hdr" || format == "pfm";
  int channels = format == "exr" ? 4 : 3;
  OIIO::TypeDesc type = isFloat ? OIIO::TypeDesc::FLOAT : OIIO::TypeDesc::UINT8;
  OIIO::ImageSpec spec(width, height, channels, type);
  // These would hold the present date, and files of equal pictures differ.
  if (std::string_view writer = output.format_name();
      writer == "openexr" || writer == "tiff")
    spec.attribute("DateTime", "1970:01:01 00:00:00");
  if (!output.open(file, spec))
    return failWith(path, output.geterror());
  bool ok;
  if (isFloat)
    ok = output.write_image(OIIO::TypeDesc::FLOAT, pixels.data(),
                            sizeof(scene::Color));
  else
    ok = output.write_image(OIIO::TypeDesc::UINT8, toBytes(pixels).data());
  std::string why = ok ? "" : output.geterror();
  if (!output.close() && ok) {
    ok = false;
    why = output.geterror();
  }
  if (!ok)
    return failWith(path, why);
  return Done{};
}

Result<Done> checkFormat(const std::string &path) {
  auto output = openFormat(path);
  if (!output)
    return output.error();
  fs::path folder = fs::path(path).parent_path();
  std::error_code ignored;
  if (!folder.empty() && !fs::is_directory(folder, ignored))
    return failWith(path, "there is no folder '" + folder.string() + "'");
  return Done{};
}

Result<Done> write(const std::string &path, int width, int height,
                   std::span<const scene::Color> pixels) {
  if (width < 1 || height < 1 || pixels.size() != size_t(width) * height)
    return failWith(path, "expected " + std::to_string(width) + " x " +
                              std::to_string(height) + " pixels, but got " +
                              std::to_string(pixels.size()));
  if (auto ok = checkFormat(path); !ok)
    return ok.error();
  auto output = openFormat(path);
  if (!output)
    return output.error();

  // Beside the image, so that renaming does not copy; with its extension,
  // which says the format.
  fs::path target(path);
  TemporaryFile temporary{target.parent_path() /
                          ("." + target.stem().string() + "." +
                           std::to_string(getpid()) + ".tmp" +
                           target.extension().string())};
  if (auto ok = writeTo(**output, path, temporary.path.string(), width, height,
                        pixels);
      !ok)
    return ok.error();
  std::error_code problem;
  fs::rename(temporary.path, target, problem);
  if (problem)
    return failWith(path, problem.message());
  return Done{};
}

Result<Image> read(const std::string &path) {
  auto fail = [&](std::string why) {
    return failTo("read", path, std::move(why));
  };
  std::error_code problem;
  if (!fs::exists(path, problem))
    return fail("there is no such file");
  auto input = OIIO::ImageInput::open(path);
  if (!input)
    return fail(OIIO::geterror());
  const OIIO::ImageSpec &spec = input->spec();
  constexpr int64_t mostPixels = int64_t(1) << 30;
  int channels = spec.nchannels;
  if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || channels < 1 ||
      int64_t(spec.width) * spec.height > mostPixels)
    return fail("expected a picture of up to 2^30 pixels");
  std::vector<float> values(size_t(spec.width) * spec.height * channels);
  if (!input->read_image(0, 0, 0, channels, OIIO::TypeDesc::FLOAT,
                         values.data()))
    return fail(input->geterror());
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
const ImageFunctions piko_image_functions = {write, checkFormat, read};
