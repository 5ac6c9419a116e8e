// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Lights that are added to an image one after the other. The sums are kept in
// several formats: half floats, numbers from 0 to 1, floats without denormals,
// and, ours, floats, which are brought into a range only when they are shown.
#include <piko.h>

#include <bit>
#include <cmath>

struct Glow {
  glm::vec2 at;    // in pixels
  float reach;     // from there
  glm::vec3 color; // negative where it takes light away
};

// What a glow gives to a pixel.
inline glm::vec3 shine(const Glow &g, glm::ivec2 pixel) {
  glm::vec2 away = (glm::vec2(pixel) + 0.5f - g.at) / g.reach;
  return g.color * glm::max(0.0f, 1 - (away.x * away.x + away.y * away.y));
}

// Half floats, rounded to nearest even; magnitudes of 65520 are infinite.
struct HalfSum {
  uint16_t bits = 0;
  void add(float more) { bits = uint16_t(toHalf(toFloat(bits) + more)); }

  static uint32_t toHalf(float value) {
    uint32_t sign = std::bit_cast<uint32_t>(value) >> 16 & 0x8000;
    float size = piko::abs(value);
    if (!(size < 65520.0f))
      return sign | (size >= 65520.0f ? 0x7c00 : 0x7e00);
    if (size < 0x1p-14f) // denormal: a multiple of 2^-24
      return sign | piko::toUint(std::rint(size * 0x1p24f));
    uint32_t bits = std::bit_cast<uint32_t>(size);
    bits += 0xfff + (bits >> 13 & 1);
    return sign | ((bits >> 13) - (112 << 10));
  }
  static float toFloat(uint32_t half) {
    float sign = half & 0x8000 ? -1.0f : 1.0f;
    uint32_t exponent = half >> 10 & 31, fraction = half & 0x3ff;
    if (exponent == 0)
      return sign * float(fraction) * 0x1p-24f;
    uint32_t bits = (exponent == 31 ? 255 : exponent + 112) << 23;
    return sign * std::bit_cast<float>(bits | fraction << 13);
  }
};

struct ClampedSum {
  float value = 0;
  void add(float more) { value = piko::clamp(value + more, 0.0f, 1.0f); }
};

struct FlushedSum {
  float value = 0;
  static float flush(float x) { return piko::abs(x) < 0x1p-126f ? 0.0f : x; }
  void add(float more) { value = flush(value + flush(more)); }
};

struct FloatSum {
  float value = 0;
  void add(float more) { value += more; }
};

template <class Sum> struct Cell {
  Sum red, green, blue;
};
template <class Sum> struct State {
  piko::Image<Cell<Sum>> image;
};

template <class Sum>
struct Add : piko::Stage<32, 32, 64, Glow>, piko::Uses<State<Sum>> {
  void assignBin(const Glow &g) {
    this->assignToBoundingBox(g, g.at - g.reach, g.at + g.reach);
  }
  void process(const Glow &g) {
    this->parallelForPixels(glm::ivec2(g.at - g.reach),
                            glm::ivec2(g.at + g.reach), [&](glm::ivec2 p) {
                              glm::vec3 more = shine(g, p);
                              this->update(this->state().image, p,
                                           [&](Cell<Sum> &cell) {
                                             cell.red.add(more.r);
                                             cell.green.add(more.g);
                                             cell.blue.add(more.b);
                                           });
                            });
  }
};

template <class Sum> struct Pipeline : piko::Pipe<State<Sum>> {
  Add<Sum> add;
  Pipeline() { this->source(add); }
};
struct HalfColors : Pipeline<HalfSum> {};
struct ClampedColors : Pipeline<ClampedSum> {};
struct FlushedColors : Pipeline<FlushedSum> {};
struct FloatColors : Pipeline<FloatSum> {};
