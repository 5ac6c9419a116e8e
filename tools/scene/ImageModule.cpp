//===- ImageModule.cpp - Images in files with OpenImageIO -----------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "ImageModule.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <string_view>

#include <sys/mman.h>
#include <unistd.h>

using namespace piko;
using namespace piko::render;

namespace {

std::unique_ptr<OIIO::ImageOutput> openFormat(const std::string &extension) {
  auto output = OIIO::ImageOutput::create("image." + extension);
  if (!output) {
    OIIO::geterror(); // its text speaks of plugins
    return nullptr;
  }
  std::string_view format = output->format_name();
  if (format == "null" || format == "term") // They write no file.
    return nullptr;
  return output;
}

bool hasFormat(const std::string &extension) {
  return openFormat(extension) != nullptr;
}

/// A file in memory, for formats that write to nothing but names.
class MemoryFile {
public:
  MemoryFile() : descriptor(memfd_create("piko-image", MFD_CLOEXEC)) {}
  MemoryFile(const MemoryFile &) = delete;
  MemoryFile &operator=(const MemoryFile &) = delete;
  ~MemoryFile() {
    if (descriptor >= 0)
      close(descriptor);
  }
  std::string name() const {
    return "/proc/self/fd/" + std::to_string(descriptor);
  }
  Result<Done> write(std::string_view content) const {
    for (size_t done = 0; done < content.size();) {
      ssize_t written = pwrite(descriptor, content.data() + done,
                               content.size() - done, off_t(done));
      if (written < 0 && errno == EINTR)
        continue;
      if (written <= 0)
        return Error{std::strerror(errno)};
      done += size_t(written);
    }
    return Done{};
  }
  std::string read() const {
    std::ifstream file(name(), std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

private:
  int descriptor;
};

/// 8 bits, but for the formats that hold floats.
OIIO::ImageSpec describe(const std::string &format, int width, int height,
                         std::string_view writer) {
  bool isFloat = format == "exr" || format == "hdr" || format == "pfm";
  OIIO::TypeDesc type = isFloat ? OIIO::TypeDesc::FLOAT : OIIO::TypeDesc::UINT8;
  OIIO::ImageSpec spec(width, height, format == "exr" ? 4 : 3, type);
  // These would hold the present date, and files of equal pictures differ.
  if (writer == "openexr" || writer == "tiff")
    spec.attribute("DateTime", "1970:01:01 00:00:00");
  return spec;
}

/// Opens, writes and closes; what went wrong first is the error.
Result<Done> writeAll(OIIO::ImageOutput &output, const std::string &name,
                      const OIIO::ImageSpec &spec,
                      std::span<const scene::Color> pixels) {
  if (!output.open(name, spec))
    return Error{output.geterror()};
  bool ok;
  if (spec.format == OIIO::TypeDesc::FLOAT) {
    ok = output.write_image(OIIO::TypeDesc::FLOAT, pixels.data(),
                            sizeof(scene::Color));
  } else {
    // HEIF's writer reads rows as long as libheif's, whose pixels are a
    // multiple of 64: the last one beyond the picture's end.
    constexpr size_t pixelsOfRow = 64;
    auto bytes = toBytes(pixels);
    bytes.resize(bytes.size() + pixelsOfRow * size_t(spec.nchannels));
    ok = output.write_image(OIIO::TypeDesc::UINT8, bytes.data());
  }
  std::string why = ok ? "" : output.geterror();
  if (!output.close() && ok) {
    ok = false;
    why = output.geterror();
  }
  if (!ok)
    return Error{why};
  return Done{};
}

/// The library's writers of some formats cut sizes to 16 bits; so the file is
/// asked.
Result<Done> checkSize(const std::string &extension, const std::string &content,
                       int width, int height) {
  auto input = OIIO::ImageInput::create(extension);
  if (!input) {
    OIIO::geterror();
    return Done{}; // It is written alone.
  }
  MemoryFile file;
  if (auto ok = file.write(content); !ok)
    return ok;
  OIIO::ImageSpec spec;
  if (!input->open(file.name(), spec) || spec.width != width ||
      spec.height != height) {
    input->geterror();
    return Error{"its format, as OpenImageIO writes it, does not hold " +
                 std::to_string(width) + " x " + std::to_string(height) +
                 " pixels"};
  }
  return Done{};
}

Result<std::string> encodeUnchecked(OIIO::ImageOutput &output,
                                    const OIIO::ImageSpec &spec,
                                    const std::string &extension,
                                    std::span<const scene::Color> pixels) {
  if (output.supports("ioproxy")) {
    OIIO::Filesystem::IOVecOutput stream;
    output.set_ioproxy(&stream);
    if (auto ok = writeAll(output, "image." + extension, spec, pixels); !ok)
      return ok.error();
    return std::string(stream.buffer().begin(), stream.buffer().end());
  }
  MemoryFile file;
  if (auto ok = writeAll(output, file.name(), spec, pixels); !ok)
    return ok.error();
  return file.read();
}

Result<std::string> encode(const std::string &extension, int width, int height,
                           std::span<const scene::Color> pixels) {
  auto output = openFormat(extension);
  if (!output)
    return Error{"no image format has the extension '" + extension + "'"};
  std::string_view writer = output->format_name();
  constexpr int mostOfJPEG = 65500; // libjpeg ends the process beyond it.
  if (writer == "jpeg" && std::max(width, height) > mostOfJPEG)
    return Error{"JPEG holds up to " + std::to_string(mostOfJPEG) +
                 " pixels a side"};
  auto content = encodeUnchecked(
      *output, describe(extension, width, height, writer), extension, pixels);
  if (!content)
    return content;
  if (auto ok = checkSize(extension, *content, width, height); !ok)
    return ok.error();
  return content;
}

/// Integers over the largest one, so that equal parts of it are equal numbers
/// whatever their width is: the library multiplies by a rounded reciprocal.
template <class Integer>
bool readIntegers(OIIO::ImageInput &input, OIIO::TypeDesc type,
                  std::vector<float> &values) {
  std::vector<Integer> integers(values.size());
  if (!input.read_image(0, 0, 0, input.spec().nchannels, type, integers.data()))
    return false;
  for (size_t i = 0; i < values.size(); ++i)
    values[i] = float(integers[i]) / float(std::numeric_limits<Integer>::max());
  return true;
}

bool readValues(OIIO::ImageInput &input, std::vector<float> &values) {
  OIIO::TypeDesc type = input.spec().format;
  if (type == OIIO::TypeDesc::UINT8)
    return readIntegers<uint8_t>(input, type, values);
  if (type == OIIO::TypeDesc::UINT16)
    return readIntegers<uint16_t>(input, type, values);
  return input.read_image(0, 0, 0, input.spec().nchannels,
                          OIIO::TypeDesc::FLOAT, values.data());
}

/// The readers of some formats leave their buffers, up to OpenImageIO 2.4.12,
/// that of GIF in opening a file already; and they are tried whatever a file's
/// name is.
bool hasUnsoundReader(const std::string &path) {
  std::array<char, 4> begin{};
  std::ifstream file(path, std::ios::binary);
  file.read(begin.data(), begin.size());
  std::string_view signature(begin.data(), begin.size());
  return signature == "GIF8" || signature == std::string_view("\0\0\1\0", 4);
}

/// What the library says, in a line and without a final stop; it may say
/// nothing.
Error describeProblem(std::string why) {
  why.resize(std::min(why.find('\n'), why.size()));
  while (why.ends_with('.') || why.ends_with(' '))
    why.pop_back();
  if (why.starts_with("OpenImageIO could not find a format reader"))
    why = "it is of no format that OpenImageIO reads";
  if (why.size() > 1 && std::islower(static_cast<unsigned char>(why[1])))
    why[0] = char(std::tolower(static_cast<unsigned char>(why[0])));
  return {why.empty() ? "it is cut short or damaged" : why};
}

Result<Image> read(const std::string &path) {
  if (hasUnsoundReader(path))
    return Error{"GIF and ICO images are not read"};
  // Colours as the file has them, also beside alpha: what the library would
  // make of them depends on its version.
  OIIO::ImageSpec asStored;
  asStored.attribute("oiio:UnassociatedAlpha", 1);
  auto input = OIIO::ImageInput::open(path, &asStored);
  if (!input)
    return describeProblem(OIIO::geterror());
  if (std::string_view(input->format_name()) == "rla")
    return Error{"RLA images are not read"};
  const OIIO::ImageSpec &spec = input->spec();
  constexpr int64_t mostPixels = int64_t(1) << 30;
  int channels = spec.nchannels;
  if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || channels < 1 ||
      int64_t(spec.width) * spec.height > mostPixels)
    return Error{"expected a picture of up to 2^30 pixels"};
  std::vector<float> values(size_t(spec.width) * spec.height * channels);
  if (!readValues(*input, values))
    return describeProblem(input->geterror());
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
const ImageFunctions piko_image_functions = {hasFormat, encode, read};
