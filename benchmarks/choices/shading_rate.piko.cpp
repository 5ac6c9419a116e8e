// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// examples/visibility, shaded once for each block of pixels: at the first that
// shows anything; by contrast of depths, once more for those that are not about
// as far away; or, by contrast of colours, at some pixels of each block, and at
// the others only where these differ.
#include "visibility/visibility.piko.cpp"

#include <bit>

namespace visibility {

template <int Bin, int Rate, bool ByContrast>
struct CoarseShade : Shade<Bin, piko::Precision::Strict> {
  void schedule(piko::BinId bin) {
    Shade<Bin, piko::Precision::Strict>::schedule(bin);
    this->specifyLanes(piko::Lanes::Iterations);
  }

  void process(const piko::List<Nothing> &) {
    glm::ivec2 lo = this->binLo(), hi = glm::min(this->binHi(), this->domain());
    glm::ivec2 blocks = (hi - lo + Rate - 1) / Rate;
    this->parallelFor(blocks.x * blocks.y, [&](int i) {
      glm::ivec2 first = lo + Rate * glm::ivec2(i % blocks.x, i / blocks.x);
      glm::ivec2 size = glm::min(hi - first, Rate);
      float nearness = paint(first, size, 0);
      if (ByContrast)
        paint(first, size, nearness);
    });
  }

private:
  static float nearnessOf(uint64_t key) {
    return std::bit_cast<float>(uint32_t(key >> 32));
  }
  static bool areAlike(float a, float b) {
    return glm::abs(a - b) <= 0.02f * glm::max(a, b);
  }

  // Paints the pixels of a block as the first of them looks: all, or those
  // about as far away; with a nearness that of others, those that are not.
  // Returns how near that pixel is, 0 if there is none.
  float paint(glm::ivec2 first, glm::ivec2 size, float others) {
    uint64_t shaded = 0;
    glm::ivec2 at(0);
    for (int k = size.x * size.y - 1; k >= 0; --k) {
      glm::ivec2 p = first + glm::ivec2(k % size.x, k / size.x);
      uint64_t key = this->state().visible(p).key;
      if (key != 0 && (others == 0 || !areAlike(nearnessOf(key), others))) {
        shaded = key;
        at = p;
      }
    }
    if (shaded == 0)
      return 0;
    Color8 color =
        toColor8(glm::vec4(this->shade(at, int32_t(~uint32_t(shaded))), 1));
    float nearness = nearnessOf(shaded);
    for (int k = 0; k < size.x * size.y; ++k) {
      glm::ivec2 p = first + glm::ivec2(k % size.x, k / size.x);
      uint64_t key = this->state().visible(p).key;
      float here = nearnessOf(key);
      bool isOurs = others != 0 ? !areAlike(here, others)
                                : !ByContrast || areAlike(here, nearness);
      if (key != 0 && isOurs)
        this->update(this->state().color, p, [&](Color8 &c) { c = color; });
    }
    return nearness;
  }
};

#ifndef CONTRAST
#define CONTRAST 0.02
#endif
/// The contrast of colours, (a - b) / (a + b), above which all pixels of a
/// block are shaded.
constexpr float greatestContrast = CONTRAST;

/// Which pixels of a block are shaded first: two of four, or the corners.
template <int Rate> struct Probes {
  static constexpr int count = Rate == 2 ? 2 : 4;
  static constexpr int others = Rate * Rate - count;

  static glm::ivec2 probe(int i) {
    return (Rate - 1) * (Rate == 2 ? glm::ivec2(i) : glm::ivec2(i & 1, i >> 1));
  }
  static glm::ivec2 other(int i) {
    if (Rate == 2)
      return {1 - i, i};
    constexpr int inner = Rate - 2; // rows, and columns of the first and last
    if (i < inner * Rate)
      return {i % Rate, 1 + i / Rate};
    i -= inner * Rate;
    return {1 + i % inner, i / inner * (Rate - 1)};
  }

  /// A pixel between them.
  static glm::vec3 between(const glm::vec3 *colors, glm::ivec2 at) {
    if (Rate == 2)
      return 0.5f * (colors[0] + colors[1]);
    glm::vec2 part = glm::vec2(at) / float(Rate - 1);
    return glm::mix(glm::mix(colors[0], colors[1], part.x),
                    glm::mix(colors[2], colors[3], part.x), part.y);
  }
};

template <int Bin, int Rate>
struct AdaptiveShade : Shade<Bin, piko::Precision::Strict> {
  void schedule(piko::BinId bin) {
    Shade<Bin, piko::Precision::Strict>::schedule(bin);
    this->specifyLanes(piko::Lanes::Iterations);
  }

  void process(const piko::List<Nothing> &) {
    glm::ivec2 lo = this->binLo(), hi = glm::min(this->binHi(), this->domain());
    glm::ivec2 blocks = (hi - lo + Rate - 1) / Rate;
    int count = blocks.x * blocks.y;
    auto firstOf = [&](int i) {
      return lo + Rate * glm::ivec2(i % blocks.x, i / blocks.x);
    };
    constexpr int most = (Bin / Rate) * (Bin / Rate), probes = Pixels::count;
    glm::vec3 colors[most * probes];
    this->parallelFor(count * probes, [&](int i) {
      glm::ivec2 first = firstOf(i / probes), last = hi - first - 1;
      glm::ivec2 p = first + glm::min(Pixels::probe(i % probes), last);
      colors[i] = shadeAt(p);
      paint(p, colors[i]);
    });
    // Blocks to shade in full are gathered, so that no lane waits for others'.
    int32_t isFull[most], full[most];
    this->parallelFor(count, [&](int i) {
      glm::ivec2 first = firstOf(i), size = glm::min(hi - first, Rate);
      isFull[i] = isFlat(first, size, &colors[i * probes]) ? 0 : 1;
      if (!isFull[i])
        fill(first, size, &colors[i * probes]);
    });
    this->parallelFor(count, [&](int i) {
      int place = this->scan(isFull[i], [](int a, int b) { return a + b; });
      if (isFull[i])
        full[place] = i;
    });
    int fullCount = this->count(count, [&](int i) { return isFull[i] != 0; });
    this->parallelFor(fullCount * Pixels::others, [&](int i) {
      glm::ivec2 p =
          firstOf(full[i / Pixels::others]) + Pixels::other(i % Pixels::others);
      if (glm::all(glm::lessThan(p, hi)))
        paint(p, shadeAt(p));
    });
  }

private:
  using Pixels = Probes<Rate>;

  bool isSeen(glm::ivec2 p) { return this->state().visible(p).key != 0; }

  glm::vec3 shadeAt(glm::ivec2 p) {
    uint64_t key = this->state().visible(p).key;
    return key == 0 ? glm::vec3(0) : this->shade(p, int32_t(~uint32_t(key)));
  }

  void paint(glm::ivec2 p, glm::vec3 color) {
    if (isSeen(p))
      this->update(this->state().color, p,
                   [&](Color8 &c) { c = toColor8(glm::vec4(color, 1)); });
  }

  // Whether all of a block's probes show something, and look alike.
  bool isFlat(glm::ivec2 first, glm::ivec2 size, const glm::vec3 *colors) {
    glm::vec3 lo = colors[0], hi = colors[0];
    bool areSeen = true;
    for (int i = 0; i < Pixels::count; ++i) {
      lo = glm::min(lo, colors[i]);
      hi = glm::max(hi, colors[i]);
      areSeen &= isSeen(first + glm::min(Pixels::probe(i), size - 1));
    }
    return areSeen &&
           !glm::any(glm::greaterThan(hi - lo, greatestContrast * (hi + lo)));
  }

  // Paints a block's other pixels as what is between its probes.
  void fill(glm::ivec2 first, glm::ivec2 size, const glm::vec3 *colors) {
    for (int i = 0; i < Pixels::others; ++i) {
      glm::ivec2 at = Pixels::other(i);
      if (glm::all(glm::lessThan(at, size)))
        paint(first + at, Pixels::between(colors, at));
    }
  }
};

template <int Rate, bool ByContrast>
struct Coarse
    : Pipeline<64, piko::Precision::Strict, CoarseShade<64, Rate, ByContrast>> {
};

} // namespace visibility

struct Rate1 : visibility::Pipeline<64> {};
struct Rate2 : visibility::Coarse<2, false> {};
struct Rate4 : visibility::Coarse<4, false> {};
struct Contrast2 : visibility::Coarse<2, true> {};
struct Contrast4 : visibility::Coarse<4, true> {};
template <int Rate>
struct Adaptive : visibility::Pipeline<64, piko::Precision::Strict,
                                       visibility::AdaptiveShade<64, Rate>> {};
struct Colors2 : Adaptive<2> {};
struct Colors4 : Adaptive<4> {};
