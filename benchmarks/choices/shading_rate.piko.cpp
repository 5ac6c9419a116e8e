// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// examples/visibility, shaded once for each block of pixels: at the first that
// shows anything; or, by contrast, once more for those that are not about as
// far away.
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
