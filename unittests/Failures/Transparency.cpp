//===- Transparency.cpp - Too many layers, and those of equal depth -------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Cast.h"
#include "Failure.h"

#include "BitonicLayers.h"
#include "ByteLayers.h"
#include "FirstLayers.h"
#include "SortedLayers.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <utility>

namespace failures {
namespace {

struct Layer {
  glm::ivec2 pixel;
  float depth;
  glm::vec4 rgba; // premultiplied
};

/// Translucent discs, as the layers of the pixels of a picture.
struct Discs {
  int size;
  std::vector<Layer> layers;

  /// `levels` different depths; 0: all are different.
  Discs(int size, int count, int levels, float alpha) : size(size) {
    std::mt19937 random(5);
    auto below = [&](int n) { return int(random() % n); };
    for (int i = 0; i < count; ++i) {
      glm::vec2 middle(below(size), below(size));
      float radius = size * (0.3f + 0.1f * i / count);
      float depth = float(levels > 0 ? below(levels) : below(1 << 20));
      glm::vec3 color = hue(below(6)) * alpha;
      for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x)
          if (glm::distance(middle, glm::vec2(x, y)) < radius)
            layers.push_back({{x, y}, depth, glm::vec4(color, alpha)});
    }
  }

  static glm::vec3 hue(int i) {
    return {i % 3 == 0 || i == 4, i % 3 == 1 || i == 5, i % 3 == 2 || i == 3};
  }
};

/// In doubles; of layers at the same depth the first is in front.
std::vector<glm::dvec3> blendExactly(const Discs &discs) {
  const std::vector<Layer> &layers = discs.layers;
  std::vector<size_t> order(layers.size());
  std::iota(order.begin(), order.end(), size_t(0));
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return std::pair(layers[a].depth, a) > std::pair(layers[b].depth, b);
  });
  std::vector<glm::dvec3> colors(discs.size * discs.size,
                                 glm::dvec3(piko::scene::Color().rgba));
  for (size_t i : order) {
    const Layer &l = layers[i];
    glm::dvec3 &color = colors[l.pixel.y * discs.size + l.pixel.x];
    color = glm::dvec3(l.rgba) + (1 - double(l.rgba.a)) * color;
  }
  return colors;
}

template <class Pipe> Image blend(const Discs &discs) {
  auto layers = castAll<typename Pipe::Layer>(discs.layers);
  Pipe pipe;
  pipe.setDomain({discs.size, discs.size});
  pipe.feed(pipe.blend, layers);
  if constexpr (requires { pipe.resolve; }) {
    const typename Pipe::Nothing *nothing = nullptr;
    pipe.feed(1, nothing, 0);
  }
  pipe.run().orThrow();
  auto image = pipe.state().color.view();
  return paint(discs.size, discs.size, [&](int x, int y) {
    auto color = image(x, y);
    if constexpr (sizeof(color) == 4)
      return rgb(float(color.rgba & 255) / 255,
                 float(color.rgba >> 8 & 255) / 255,
                 float(color.rgba >> 16 & 255) / 255);
    else
      return std::bit_cast<piko::scene::Color>(color);
  });
}

/// The largest error of any channel.
double greatestError(const Image &image, const std::vector<glm::dvec3> &exact) {
  double error = 0;
  for (size_t i = 0; i < exact.size(); ++i) {
    glm::dvec3 off = glm::abs(glm::dvec3(image.pixels[i].rgba) - exact[i]);
    error = std::max({error, off.x, off.y, off.z});
  }
  return error;
}

template <class Naive> Errors compare(const Discs &discs) {
  auto exact = blendExactly(discs);
  return {greatestError(blend<Naive>(discs), exact),
          greatestError(blend<pipelines::SortedLayers>(discs), exact)};
}

template <class Naive> Pictures show(const Discs &discs) {
  return {blend<Naive>(discs), blend<pipelines::SortedLayers>(discs)};
}

constexpr const char *ours = "sorts all layers, stably, in floats";
constexpr const char *error = "largest error of a colour";

struct KBufferOverflow : Mode {
  Description describe() const override {
    return {"KBufferOverflow",
            "More layers than a k-buffer holds",
            "translucent discs, of which a third cover a pixel",
            error,
            "keeps the first eight of a pixel",
            ours,
            {4, 8, 16, 32, 64, 128, 256}};
  }
  Errors measure(double discs) const override {
    return compare<pipelines::FirstLayers>({48, int(discs), 0, 0.3f});
  }
  Pictures draw() const override {
    return show<pipelines::FirstLayers>({192, 48, 0, 0.5f});
  }
};
const Registration<KBufferOverflow> overflow;

TEST(Failure, KBufferOverflow) {
  Errors errors = KBufferOverflow().measure(256);
  EXPECT_GT(errors.naive, 0.3);
  EXPECT_LT(errors.ours, 1e-6);
}

struct EqualDepths : Mode {
  Description describe() const override {
    return {"EqualDepths",
            "Layers at the same depth, the first in front",
            "translucent discs at two depths",
            error,
            "bitonic sort, which is not stable",
            ours,
            {2, 4, 8, 16, 32, 64}};
  }
  Errors measure(double discs) const override {
    return compare<pipelines::BitonicLayers>({64, int(discs), 2, 0.5f});
  }
  Pictures draw() const override {
    return show<pipelines::BitonicLayers>({192, 16, 2, 0.75f});
  }
};
const Registration<EqualDepths> equalDepths;

TEST(Failure, EqualDepths) {
  for (int discs : {8, 64}) {
    Errors errors = EqualDepths().measure(discs);
    EXPECT_GT(errors.naive, 0.2) << discs;
    EXPECT_LT(errors.ours, 1e-6) << discs;
  }
}

struct ThousandLayers : Mode {
  Description describe() const override {
    return {"ThousandLayers",
            "Thin layers, of which only all together are seen",
            "translucent discs with an opacity of 2 divided by their number",
            error,
            "blends into 8 bits a channel",
            ours,
            {16, 64, 256, 512, 1024, 2048}};
  }
  Errors measure(double discs) const override {
    return compare<pipelines::ByteLayers>(
        {32, int(discs), 0, float(2 / discs)});
  }
  Pictures draw() const override {
    return show<pipelines::ByteLayers>({128, 500, 0, 0.0019f});
  }
};
const Registration<ThousandLayers> thousandLayers;

TEST(Failure, ThousandLayers) {
  Errors errors = ThousandLayers().measure(1024);
  EXPECT_GT(errors.naive, 0.1);
  EXPECT_LT(errors.ours, 1e-5);
}

} // namespace
} // namespace failures
