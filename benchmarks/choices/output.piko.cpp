// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// examples/raster's Tiled with a result in other formats.
#include "raster/raster.piko.cpp"

#include <bit>

namespace raster {

struct Bytes {
  static float round(float value, glm::ivec2) {
    return glm::floor(glm::clamp(value, 0.0f, 1.0f) * 255 + 0.5f) / 255;
  }
};

/// Ordered dither (Bayer 1973) of 8 by 8 pixels: what is lost below a step of
/// 1/255 becomes how many pixels take the next one.
struct DitheredBytes {
  static float round(float value, glm::ivec2 pixel) {
    int threshold = 0;
    for (int bit = 0; bit < 3; ++bit) {
      int x = pixel.x >> bit & 1, y = pixel.y >> bit & 1;
      threshold = threshold << 2 | (x ^ y) << 1 | y;
    }
    float part = (float(threshold) + 0.5f) / 64;
    return glm::floor(glm::clamp(value, 0.0f, 1.0f) * 255 + part) / 255;
  }
};

/// Of 11 significant bits, to nearest, ties to even.
struct Half {
  static float round(float value, glm::ivec2) {
    uint32_t bits = std::bit_cast<uint32_t>(value);
    bits += 0xfff + (bits >> 13 & 1);
    float rounded = std::bit_cast<float>(bits & ~0x1fffu);
    // Below the least normal number steps are of one size.
    float small = (glm::abs(value) + 0.5f) - 0.5f;
    return glm::abs(value) < 0x1p-14f ? small : rounded;
  }
};

template <Mapping M, class Format>
struct Store : piko::Stage<M.bin, M.bin, 64, Nothing>, piko::Uses<State> {
  void assignBin(const Nothing &n) { this->assignToAll(n); }
  void schedule(piko::BinId) {
    this->everyBin();
    this->template endStage<Composite<M>>();
  }

  void process(const piko::List<Nothing> &) {
    this->parallelForPixels([&](glm::ivec2 p) {
      this->update(this->state().color, p, [&](Color &c) {
        for (int i = 0; i < 3; ++i)
          c.rgba[i] = Format::round(c.rgba[i], p);
      });
    });
  }
};

constexpr Mapping tiled = {.bin = 32, .apart = false, .waits = true};
template <class Format> struct Stored : IndexedRaster<tiled> {
  Store<tiled, Format> store;
  Stored() { this->source(store); }
};

} // namespace raster

struct OutputFloat : raster::IndexedRaster<raster::tiled> {};
struct OutputBytes : raster::Stored<raster::Bytes> {};
struct OutputDithered : raster::Stored<raster::DitheredBytes> {};
struct OutputHalf : raster::Stored<raster::Half> {};
