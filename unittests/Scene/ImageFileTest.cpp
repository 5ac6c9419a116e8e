//===- ImageFileTest.cpp - Images of all formats, and failures ------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "../Support/TemporaryFolder.h"

#include "Piko/Scene/ImageFile.h"

#include <OpenImageIO/imageio.h>

#include <chrono>
#include <limits>
#include <set>
#include <sstream>
#include <thread>
#include <vector>

using namespace piko::render;
using piko::scene::Color;
namespace fs = std::filesystem;

namespace {

class ImageFile : public TemporaryFolder {
protected:
  static constexpr int width = 3, height = 2;
  std::vector<Color> pixels{{{0, 0.5f, 1, 1}},        {{0.1f, 0.1f, 0.1f, 0}},
                            {{-1, 2, 1e30f, 1}},      {{0.25f, 0.75f, 0, 1}},
                            {{0.998f, 0.999f, 1, 1}}, {{1e-3f, 0, 0, 0.5f}}};

  /// Why an image could not be written; the message must name it.
  std::string errorOf(const std::string &path) {
    auto result = writeImage(path, width, height, pixels);
    if (result)
      return "no error";
    EXPECT_NE(result.error().message.find("'" + path + "'"), std::string::npos)
        << result.error().message;
    return result.error().message;
  }
  size_t countFiles() const {
    return size_t(std::distance(fs::directory_iterator(folder), {}));
  }
};

template <class T>
std::vector<T> readBack(const std::string &path, int channels,
                        OIIO::TypeDesc type) {
  auto input = OIIO::ImageInput::open(path);
  if (!input || input->spec().nchannels != channels) {
    ADD_FAILURE() << path;
    return {};
  }
  const OIIO::ImageSpec &spec = input->spec();
  std::vector<T> data(size_t(spec.width) * spec.height * channels);
  EXPECT_TRUE(input->read_image(0, 0, 0, channels, type, data.data()));
  return data;
}

TEST(ToByte, RoundsAndClamps) {
  EXPECT_EQ(toByte(0), 0);
  EXPECT_EQ(toByte(1), 255);
  EXPECT_EQ(toByte(0.1f), 26); // 25.5 goes up
  EXPECT_EQ(toByte(-5), 0);
  EXPECT_EQ(toByte(7), 255);
  EXPECT_EQ(toByte(std::numeric_limits<float>::infinity()), 255);
  EXPECT_EQ(toByte(std::numeric_limits<float>::quiet_NaN()), 0);
}

// As an image of 8 bits would have been written from floats.
TEST_F(ImageFile, Color8HasTheBytesOfAFile) {
  pixels.push_back({{std::numeric_limits<float>::quiet_NaN(), -0.0f,
                     std::numeric_limits<float>::infinity(), 0.5f}});
  for (const Color &pixel : pixels) {
    uint32_t rgba = piko::scene::toColor8(pixel.rgba).rgba;
    for (int i = 0; i < 4; ++i)
      EXPECT_EQ(rgba >> (8 * i) & 255, toByte(pixel.rgba[i])) << i;
  }
  EXPECT_EQ(piko::scene::Color8().rgba,
            piko::scene::toColor8(Color().rgba).rgba);
}

TEST_F(ImageFile, EightBitFormats) {
  for (const char *name : {"a.png", "a.ppm", "A.PNG", "a.bmp", "a.tif"}) {
    auto written = writeImage(pathOf(name), width, height, pixels);
    ASSERT_TRUE(written) << written.error().message;
    auto bytes = readBack<uint8_t>(pathOf(name), 3, OIIO::TypeDesc::UINT8);
    ASSERT_EQ(bytes.size(), pixels.size() * 3) << name;
    for (size_t i = 0; i < pixels.size(); ++i)
      for (int c = 0; c < 3; ++c)
        EXPECT_EQ(bytes[3 * i + c], toByte(pixels[i].rgba[c])) << name;
  }
  EXPECT_EQ(countFiles(), 5u); // nothing else is left
}

TEST_F(ImageFile, ExrHoldsFloatsAndAlpha) {
  ASSERT_TRUE(writeImage(pathOf("a.exr"), width, height, pixels));
  auto floats = readBack<float>(pathOf("a.exr"), 4, OIIO::TypeDesc::FLOAT);
  ASSERT_EQ(floats.size(), pixels.size() * 4);
  for (size_t i = 0; i < pixels.size(); ++i)
    for (int c = 0; c < 4; ++c)
      EXPECT_EQ(floats[4 * i + c], pixels[i].rgba[c]);
}

/// Seconds apart, so that a date would show.
/// Writes pixels of r, g, b and alpha as a PNG.
template <class Integer>
void writePNG(const std::string &path, OIIO::TypeDesc type,
              const std::vector<Integer> &values) {
  auto output = OIIO::ImageOutput::create(path);
  ASSERT_TRUE(output);
  OIIO::ImageSpec spec(int(values.size() / 4), 1, 4, type);
  spec.attribute("oiio:UnassociatedAlpha", 1);
  ASSERT_TRUE(output->open(path, spec));
  ASSERT_TRUE(output->write_image(type, values.data()));
  ASSERT_TRUE(output->close());
}

TEST_F(ImageFile, ColoursAreReadAsStoredWhateverAlphaIs) {
  writePNG<uint8_t>(pathOf("a.png"), OIIO::TypeDesc::UINT8,
                    {255, 128, 0, 51, 10, 20, 30, 0});
  auto image = readImage(pathOf("a.png"));
  ASSERT_TRUE(image) << image.error().message;
  EXPECT_EQ(image->pixels[0].rgba, glm::vec4(1, 128 / 255.0f, 0, 51 / 255.0f));
  EXPECT_EQ(image->pixels[1].rgba,
            glm::vec4(10 / 255.0f, 20 / 255.0f, 30 / 255.0f, 0));
}

TEST_F(ImageFile, EightAndSixteenBitsOfOneColourAreEqual) {
  std::vector<uint8_t> bytes;
  std::vector<uint16_t> words;
  for (int i = 0; i < 1024; ++i) {
    bytes.push_back(uint8_t(i % 4 == 3 ? 255 : i / 4));
    words.push_back(uint16_t(bytes.back() * 257));
  }
  writePNG(pathOf("a.png"), OIIO::TypeDesc::UINT8, bytes);
  writePNG(pathOf("b.png"), OIIO::TypeDesc::UINT16, words);
  auto a = readImage(pathOf("a.png")), b = readImage(pathOf("b.png"));
  ASSERT_TRUE(a && b);
  for (size_t i = 0; i < a->pixels.size(); ++i)
    EXPECT_EQ(a->pixels[i].rgba, b->pixels[i].rgba) << i;
}

TEST_F(ImageFile, EqualPicturesAreEqualFiles) {
  auto contentOf = [&](const std::string &name) {
    EXPECT_TRUE(writeImage(pathOf(name), width, height, pixels)) << name;
    std::ifstream stream(pathOf(name), std::ios::binary);
    return std::string((std::istreambuf_iterator<char>(stream)), {});
  };
  const std::vector<std::string> formats = {"exr", "tif", "png",
                                            "jpg", "ppm", "hdr"};
  std::vector<std::string> before;
  for (const std::string &format : formats)
    before.push_back(contentOf("before." + format));
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));
  for (size_t i = 0; i < formats.size(); ++i) {
    EXPECT_FALSE(before[i].empty());
    EXPECT_TRUE(contentOf("after." + formats[i]) == before[i]) << formats[i];
  }
}

TEST_F(ImageFile, ReplacesAnOlderImage) {
  write("a.png", "old");
  ASSERT_TRUE(writeImage(pathOf("a.png"), width, height, pixels));
  readBack<uint8_t>(pathOf("a.png"), 3, OIIO::TypeDesc::UINT8);
  EXPECT_EQ(countFiles(), 1u);
}

// libjpeg would end the process, and the writers of others cut sizes.
TEST_F(ImageFile, EveryFormatHoldsASizeOrRefusesIt) {
  std::string formats;
  ASSERT_TRUE(OIIO::getattribute("output_format_list", formats));
  std::istringstream names(formats + ",jpg,gif,tga");
  const std::set<std::string> writtenAlone = {"gif", "ico", "rla"},
                              least = {"jpg", "gif", "tga"};
  for (std::string format; std::getline(names, format, ',');) {
    std::string path = pathOf("a." + format);
    if (!checkImageFormat(path))
      continue;
    for (auto [w, h] : {std::pair(3, 2), {65535, 1}, {1, 65536}, {65536, 1}}) {
      std::vector<Color> row(size_t(w) * h, Color{{0.25f, 0.5f, 1, 1}});
      bool isWritten = bool(writeImage(path, w, h, row));
      if (least.contains(format)) {
        EXPECT_EQ(isWritten, std::max(w, h) < (format == "jpg" ? 65501 : 65536))
            << format << " " << w;
      }
      if (!isWritten)
        continue;
      auto image = readImage(path);
      EXPECT_EQ(bool(image), !writtenAlone.contains(format)) << format;
      if (!image)
        continue;
      EXPECT_EQ(image->width, w) << format;
      EXPECT_EQ(image->height, h) << format;
    }
  }
}

// Whatever its name is.
TEST_F(ImageFile, AnImageWhoseReaderIsNotSound) {
  ASSERT_TRUE(writeImage(pathOf("a.gif"), width, height, pixels));
  fs::rename(pathOf("a.gif"), pathOf("a.png"));
  auto image = readImage(pathOf("a.png"));
  ASSERT_FALSE(image);
  EXPECT_NE(image.error().message.find("GIF"), std::string::npos);
}

TEST_F(ImageFile, UnknownFormats) {
  EXPECT_NE(errorOf(pathOf("a.nope")).find("extension 'nope'"),
            std::string::npos);
  EXPECT_NE(errorOf(pathOf("image")).find("ends in a format"),
            std::string::npos);
  for (const char *format : {"nope", "null", "term"})
    EXPECT_FALSE(checkImageFormat(pathOf(std::string("a.") + format)));
  EXPECT_TRUE(checkImageFormat(pathOf("a.png")));
  EXPECT_EQ(countFiles(), 0u);
}

TEST_F(ImageFile, PlacesThatCannotBeWritten) {
  EXPECT_NE(errorOf(pathOf("none/a.png")).find("no folder"), std::string::npos);
  fs::create_directories(pathOf("folder.png"));
  EXPECT_NE(errorOf(pathOf("folder.png")), "no error");
  write("file", "");
  EXPECT_NE(errorOf(pathOf("file/a.png")), "no error");
  EXPECT_EQ(countFiles(), 2u); // no partial file
}

TEST_F(ImageFile, WrongNumberOfPixels) {
  EXPECT_FALSE(writeImage(pathOf("a.png"), 4, 4, pixels));
  EXPECT_FALSE(writeImage(pathOf("a.png"), 0, 0, {}));
}

} // namespace
