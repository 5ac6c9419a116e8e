//===- histogram.piko.cpp - Histogram equalization ------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
//   pixels --> Count -----------------------------------> Remap (output)
//                : - - (histogram) - -> Cumulate - (below) - :
//
// A pixel becomes the share of pixels in lower levels of gray than its own.
//
//===----------------------------------------------------------------------===//
#include <piko.h>

namespace histogram {

struct Pixel {
  glm::ivec2 at;
  float gray; // from 0 to 1
};

struct State {
  piko::Buffer<uint32_t> histogram; // zeros, as many as there are levels
  piko::Buffer<uint32_t> below;     // how many pixels are in lower levels
  piko::Image<float> output;
};

inline int64_t level(float gray, const piko::Buffer<uint32_t> &histogram) {
  int64_t levels = histogram.size();
  return glm::clamp(piko::toInt64(gray * float(levels)), int64_t(0),
                    levels - 1);
}

struct Count : piko::Stage<0, 0, 64, Pixel, Pixel>, piko::Uses<State> {
  void process(const Pixel &p) {
    piko::atomicAdd(state().histogram[level(p.gray, state().histogram)], 1u);
    emit(p);
  }
};

// Takes no primitive: it runs once when all pixels are counted.
struct Cumulate : piko::Stage<0, 0, 256, Pixel>, piko::Uses<State> {
  void schedule(piko::BinId) {
    everyBin();
    endStage<Count>();
  }

  void process(const piko::List<Pixel> &) {
    parallelFor(int(state().histogram.size()), [&](int i) {
      state().below[i] = scan(state().histogram[i],
                              [](uint32_t a, uint32_t b) { return a + b; });
    });
  }
};

struct Remap : piko::Stage<16, 16, 64, Pixel>, piko::Uses<State> {
  void assignBin(const Pixel &p) {
    piko::BinId bin = binFromPosition(p.at);
    if (bin.index >= 0)
      assignToBin(p, bin);
  }

  void schedule(piko::BinId) { endStage<Cumulate>(); }

  void process(const Pixel &p) {
    int64_t last = state().histogram.size() - 1;
    uint32_t pixels = state().below[last] + state().histogram[last];
    float below = float(state().below[level(p.gray, state().histogram)]);
    update(state().output, p.at,
           [&](float &gray) { gray = below / float(pixels); });
  }
};

struct Equalize : piko::Pipe<State> {
  Count count;
  Cumulate cumulate;
  Remap remap;

  Equalize() {
    source(count);    // source 0
    source(cumulate); // source 1, which has no primitives
    connect(count, 0, remap);
  }
};

} // namespace histogram
