//===- ImageFile.cpp - Images in files ------------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// PNG is written by libpng, which loads at once; for all else there is the
// module of OpenImageIO.
//
//===----------------------------------------------------------------------===//
#include "ImageModule.h"
#include "LoadedModule.h"

#include "Piko/Support/HeldSignals.h"
#include "Piko/Support/OutputFile.h"

#include <png.h>
#include <zlib.h>

#include <cerrno>
#include <cstdio>
#include <system_error>

using namespace piko;
using namespace piko::render;
namespace fs = std::filesystem;

static Error failTo(const char *what, const std::string &path,
                    std::string why) {
  if (size_t end = why.find('\n'); end != std::string::npos)
    why.resize(end);
  return {std::string("cannot ") + what + " image '" + path + "': " + why};
}

/// Loads the module at the first call.
static Result<const ImageFunctions *> getFunctions() {
  const auto *functions =
      findInModule<ImageFunctions>(imageModuleFile, imageModuleSymbol);
  if (!functions)
    return Error{std::string("without ") + imageModuleFile +
                 " Piko writes PNG alone and reads no image; `make build` "
                 "builds it, with OpenImageIO"};
  return functions;
}

// A full disk must not cut a picture, and libpng and libjpeg look at no
// stream's end; so formats are written to memory, and files by replaceFile.
static Result<std::string> encodePNG(int width, int height,
                                     std::span<const scene::Color> pixels) {
  png_image image = {};
  image.version = PNG_IMAGE_VERSION;
  image.width = png_uint_32(width);
  image.height = png_uint_32(height);
  image.format = PNG_FORMAT_RGB;
  std::vector<uint8_t> bytes = toBytes(pixels);
  std::string content;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  content.resize(size);
  if (!png_image_write_to_memory(&image, content.data(), &size,
                                 /*convert_to_8_bit=*/0, bytes.data(),
                                 /*row_stride=*/0, /*colormap=*/nullptr))
    return Error{image.message};
  content.resize(size);
  return content;
}

static Result<std::string> encode(const std::string &extension, int width,
                                  int height,
                                  std::span<const scene::Color> pixels) {
  if (extension == "png")
    return encodePNG(width, height, pixels);
  auto functions = getFunctions();
  if (!functions)
    return functions.error();
  return (*functions)->encode(extension, width, height, pixels);
}

static Result<Done> checkExtension(const std::string &extension) {
  if (extension.empty())
    return Error{"expected a name that ends in a format, such as .png"};
  if (extension == "png")
    return Done{};
  auto functions = getFunctions();
  if (!functions)
    return functions.error();
  if (!(*functions)->hasFormat(extension))
    return Error{"no image format has the extension '" + extension + "'"};
  return Done{};
}

Result<Done> render::checkImageFormat(const std::string &path) {
  if (auto ok = checkExtension(extensionOf(path)); !ok)
    return failTo("write", path, ok.error().message);
  fs::path folder = fs::path(path).parent_path();
  std::error_code ignored;
  if (!folder.empty() && !fs::is_directory(folder, ignored))
    return failTo("write", path,
                  "there is no folder '" + folder.string() + "'");
  return Done{};
}

Result<Done> render::writeImage(const std::string &path, int width, int height,
                                std::span<const scene::Color> pixels) {
  if (width < 1 || height < 1 || pixels.size() != size_t(width) * height)
    return failTo("write", path,
                  "expected " + std::to_string(width) + " x " +
                      std::to_string(height) + " pixels, but got " +
                      std::to_string(pixels.size()));
  if (auto ok = checkImageFormat(path); !ok)
    return ok.error();

  // A limit on files is one on files in memory, too.
  support::HeldSignals signals;
  auto content = encode(extensionOf(path), width, height, pixels);
  if (!content)
    return failTo("write", path, content.error().message);
  if (auto ok = support::replaceFile(path, *content); !ok)
    return failTo("write", path, ok.error().message);
  return Done{};
}

/// Of a PNG file: whether its chunks are there and have the right checksums.
/// OpenImageIO's reader prints what it thinks of those that do not.
static Result<Done> checkChunks(const std::string &path) {
  std::string content;
  if (std::FILE *file = std::fopen(path.c_str(), "rb")) {
    char part[1 << 16];
    while (size_t count = std::fread(part, 1, sizeof part, file))
      content.append(part, count);
    bool isRead = !std::ferror(file);
    std::fclose(file);
    if (!isRead)
      return Error{std::generic_category().message(errno)};
  }
  constexpr std::string_view signature("\x89PNG\r\n\x1a\n", 8);
  if (!content.starts_with(signature))
    return Done{}; // of another format
  auto read = [&](size_t at) {
    uint32_t number = 0;
    for (size_t i = 0; i < 4; ++i)
      number = number << 8 | static_cast<unsigned char>(content[at + i]);
    return size_t(number);
  };
  constexpr size_t around = 12; // the chunk's length, type and checksum
  for (size_t at = signature.size(); at + around <= content.size();) {
    size_t length = read(at);
    if (length > content.size() - at - around)
      break;
    std::string_view chunk =
        std::string_view(content).substr(at + 4, length + 4);
    if (crc32(0, reinterpret_cast<const Bytef *>(chunk.data()),
              uInt(chunk.size())) != read(at + 8 + length))
      return Error{"a checksum is wrong: it is damaged"};
    if (chunk.starts_with("IEND"))
      return Done{};
    at += around + length;
  }
  return Error{"it is cut short"};
}

Result<Image> render::readImage(const std::string &path) {
  std::error_code problem;
  if (!fs::exists(path, problem))
    return failTo("read", path, "there is no such file");
  if (fs::is_directory(path, problem))
    return failTo("read", path, "it is a folder");
  if (auto ok = checkChunks(path); !ok)
    return failTo("read", path, ok.error().message);
  auto functions = getFunctions();
  if (!functions)
    return failTo("read", path, functions.error().message);
  auto image = (*functions)->read(path);
  if (!image)
    return failTo("read", path, image.error().message);
  return image;
}
