//===- ImageFile.cpp - Images in files ------------------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// PNG is written by libpng, which loads at once; for all else there is the
// module of OpenImageIO.
//
//===----------------------------------------------------------------------===//
#include "ImageModule.h"

#include <dlfcn.h>
#include <png.h>
#include <unistd.h>

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
  static void *module = dlopen(imageModuleFile, RTLD_NOW | RTLD_LOCAL);
  void *symbol = module ? dlsym(module, imageModuleSymbol) : nullptr;
  if (!symbol)
    return Error{std::string("without ") + imageModuleFile +
                 " Piko writes PNG alone and reads no image; `make build` "
                 "builds it, with OpenImageIO"};
  return static_cast<const ImageFunctions *>(symbol);
}

static Result<Done> writePNG(const std::string &file, int width, int height,
                             std::span<const scene::Color> pixels) {
  png_image image = {};
  image.version = PNG_IMAGE_VERSION;
  image.width = png_uint_32(width);
  image.height = png_uint_32(height);
  image.format = PNG_FORMAT_RGB;
  if (!png_image_write_to_file(&image, file.c_str(), /*convert_to_8_bit=*/0,
                               toBytes(pixels).data(), /*row_stride=*/0,
                               /*colormap=*/nullptr))
    return Error{image.message};
  return Done{};
}

static Result<Done> writeFormat(const std::string &file, int width, int height,
                                std::span<const scene::Color> pixels) {
  if (extensionOf(file) == "png")
    return writePNG(file, width, height, pixels);
  auto functions = getFunctions();
  if (!functions)
    return functions.error();
  return (*functions)->write(file, width, height, pixels);
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

namespace {

/// Removes a file unless it was renamed before.
struct TemporaryFile {
  fs::path path;
  ~TemporaryFile() {
    std::error_code ignored;
    fs::remove(path, ignored);
  }
};

} // namespace

Result<Done> render::writeImage(const std::string &path, int width, int height,
                                std::span<const scene::Color> pixels) {
  if (width < 1 || height < 1 || pixels.size() != size_t(width) * height)
    return failTo("write", path,
                  "expected " + std::to_string(width) + " x " +
                      std::to_string(height) + " pixels, but got " +
                      std::to_string(pixels.size()));
  if (auto ok = checkImageFormat(path); !ok)
    return ok.error();

  // Beside the image, so that renaming does not copy; with its extension,
  // which says the format.
  fs::path target(path);
  TemporaryFile temporary{target.parent_path() /
                          ("." + target.stem().string() + "." +
                           std::to_string(getpid()) + ".tmp" +
                           target.extension().string())};
  if (auto ok = writeFormat(temporary.path.string(), width, height, pixels);
      !ok)
    return failTo("write", path, ok.error().message);
  std::error_code problem;
  fs::rename(temporary.path, target, problem);
  if (problem)
    return failTo("write", path, problem.message());
  return Done{};
}

Result<Image> render::readImage(const std::string &path) {
  std::error_code problem;
  if (!fs::exists(path, problem))
    return failTo("read", path, "there is no such file");
  auto functions = getFunctions();
  if (!functions)
    return failTo("read", path, functions.error().message);
  auto image = (*functions)->read(path);
  if (!image)
    return failTo("read", path, image.error().message);
  return image;
}
