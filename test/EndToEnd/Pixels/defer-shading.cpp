// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What primitives overwrite is computed once for each pixel, whatever the text
// looks like, and is what the reference executor computes.
// REQUIRES: all
// RUN: %compare_targets %s --cases %s --runs 2
// RUN: %if all %{ piko-compare %s --cases %s --runs 1 --without vectorize -O0 %}
// CASE: --pipe Nearest --domain 45 37 --count 300
// CASE: --pipe Nearest --domain 45 37 --count 0
// CASE: --pipe OneRecord --domain 45 37 --count 300
// CASE: --pipe Returns --domain 45 37 --count 300
// CASE: --pipe LastWins --domain 45 37 --count 300
// CASE: --pipe TwoImages --domain 45 37 --count 300
// CASE: --pipe TwoWays --domain 45 37 --count 300
// CASE: --pipe Points --domain 20 9 --count 900
// CASE: --pipe Behind --domain 20 9 --count 900
// CASE: --pipe Picture --domain 45 37 --count 300
// CASE: --pipe Kinds --domain 45 37 --count 300
// CASE: --pipe Lists --domain 45 37 --count 300
// CASE: --pipe Counts --domain 45 37 --count 300
// RUN: piko-compare %s --pipe Nearest --domain 45 37 --count 300 --runs 1 --strip 7 | FileCheck %s
// CHECK: equal
//
// RUN: pikoc %s --pipe Nearest,OneRecord,Returns,LastWins,TwoImages,TwoWays,Points,Behind,Picture,Kinds,Lists --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=ONCE
// ONCE-COUNT-11: remark: what is written to '{{color|image}}' is computed once for each pixel
// ONCE-NOT: remark: what is written to '{{color|image}}' is computed once for each pixel
// RUN: pikoc %s --pipe Counts --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=OFTEN
// OFTEN-NOT: is computed once for each pixel
#include <piko.h>

#include <cmath>
#include <cstdint>

#ifndef WHOLE
#define WHOLE false // gbuffer.cpp has bins that are the whole domain
#endif
constexpr int large = WHOLE ? 0 : 16, small = WHOLE ? 0 : 8;

struct Particle {
  int x, y;
  float value;
  int serial;
};

struct Color {
  float r = 0.5f, g = 0, b = 0;
};
struct Pixel {
  float z = 1000;
  Color color;
  int count = 0;
};

struct State {
  piko::Buffer<float> lights;
  piko::Image<float> depth;
  piko::Image<Color> color, other;
  piko::Image<Pixel> image;
};

template <class S> struct Alone : piko::Pipe<State> {
  S stage;
  Alone() {
    source(stage);
    allocateForSource(state().lights, 0);
  }
};

template <class Self = void>
struct Discs : piko::Stage<large, large, 64, Particle>, piko::Uses<State> {
  static constexpr int radius = 4;
  glm::ivec2 lo(const Particle &p) { return {p.x - radius, p.y - radius}; }
  glm::ivec2 hi(const Particle &p) { return {p.x + radius, p.y + radius}; }
  void assignBin(const Particle &p) { assignToBoundingBox(p, lo(p), hi(p)); }

  // Light that comes from the first buffers' numbers, which are the particles'.
  float shade(float z, float x) {
    float sum = x;
    for (int64_t i = 0; i < state().lights.size() && i < 9; ++i)
      sum += (state().lights[i] + z) / (1 + float(i) * x * x);
    return sum;
  }
  static float depthAt(const Particle &p, glm::ivec2 at) {
    return p.value + float(at.x - p.x) * 0.25f - float(at.y - p.y) * 0.125f;
  }
  static bool covers(const Particle &p, glm::ivec2 at) {
    int x = at.x - p.x, y = at.y - p.y;
    return x * x + y * y <= radius * radius - 2;
  }
};

// As a textbook has it: a test, and what passes is shaded.
struct NearestStage : Discs<> {
  void process(const Particle &p) {
    parallelForPixels(lo(p), hi(p), [&](glm::ivec2 at) {
      if (!covers(p, at))
        return;
      float z = depthAt(p, at);
      bool passed = false;
      update(state().depth, at, [&](float &nearest) {
        passed = z < nearest - 1000;
        if (passed)
          nearest = z + 1000;
      });
      if (!passed)
        return;
      float sum = shade(z, p.value);
      update(state().color, at, [&](Color &c) { c = {sum, z, float(at.x)}; });
    });
  }
};
struct Nearest : Alone<NearestStage> {};

// Test and colour in one record, one update, shaded in it.
struct OneRecordStage : Discs<> {
  void process(const Particle &p) {
    parallelForPixels(lo(p), hi(p), [&](glm::ivec2 at) {
      float z = depthAt(p, at);
      update(state().image, at, [&](Pixel &pixel) {
        if (covers(p, at) && z < pixel.z) {
          pixel.z = z;
          float sum = shade(z, p.value);
          pixel.color = {sum, sum * 0.5f, float(p.serial)};
          pixel.count += 1;
        }
      });
    });
  }
};
struct OneRecord : Alone<OneRecordStage> {};

// The other way round, and shaded before it is known whether that is needed.
struct ReturnsStage : Discs<> {
  void process(const Particle &p) {
    parallelForPixels(lo(p), hi(p), [&](glm::ivec2 at) {
      float z = depthAt(p, at), sum = shade(z, 1);
      update(state().image, at, [&](Pixel &pixel) {
        if (z >= pixel.z)
          return;
        pixel.z = z;
        pixel.color.r = sum;
        pixel.color.b = z;
      });
    });
  }
};
struct Returns : Alone<ReturnsStage> {};

// The painter's algorithm: no test at all.
struct LastWinsStage : Discs<> {
  void process(const Particle &p) {
    parallelForPixels(lo(p), hi(p), [&](glm::ivec2 at) {
      float sum = shade(p.value, float(at.x + at.y));
      if (sum < 100)
        update(state().color, at, [&](Color &c) { c.g = sum; });
    });
  }
};
struct LastWins : Alone<LastWinsStage> {};

// What is seen goes to two images.
struct TwoImagesStage : Discs<> {
  void process(const Particle &p) {
    parallelForPixels(lo(p), hi(p), [&](glm::ivec2 at) {
      float z = depthAt(p, at);
      bool seen = false;
      update(state().depth, at, [&](float &most) {
        seen = z > most;
        most = seen ? z : most;
      });
      if (seen) {
        float sum = shade(z, 2);
        update(state().color, at, [&](Color &c) { c = {sum, z, 1}; });
        update(state().other, at, [&](Color &c) { c.b = sum * z; });
      }
    });
  }
};
struct TwoImages : Alone<TwoImagesStage> {};

// Few pixels in order, more in a parallel loop: both paint alike.
struct TwoWaysStage : Discs<> {
  void paint(glm::ivec2 at, float z, float weight) {
    bool passed = false;
    update(state().depth, at, [&](float &most) {
      passed = z > most;
      if (passed)
        most = z;
    });
    if (passed) {
      float sum = shade(z, weight) * 3;
      update(state().color, at, [&](Color &c) { c = {sum, weight, z}; });
    }
  }
  void process(const Particle &p) {
    if (p.serial % 3 == 0) {
      glm::ivec2 first = glm::max(lo(p), binLo()),
                 last = glm::min(hi(p), binHi() - 1);
      for (int y = first.y; y <= last.y; ++y)
        for (int x = first.x; x <= last.x; ++x)
          paint({x, y}, depthAt(p, {x, y}), p.value * 2);
      return;
    }
    parallelForPixels(lo(p), hi(p), [&](glm::ivec2 at) {
      if (covers(p, at))
        paint(at, depthAt(p, at), float(p.x));
    });
  }
};
struct TwoWays : Alone<TwoWaysStage> {};

// One pixel each, many in one.
struct PointsStage : piko::Stage<small, small, 64, Particle>,
                     piko::Uses<State> {
  void assignBin(const Particle &p) {
    if (p.x >= 0 && p.y >= 0 && p.x < domain().x && p.y < domain().y)
      assignToBin(p, binFromPosition(glm::ivec2(p.x, p.y)));
  }
  void process(const Particle &p) {
    glm::ivec2 at(p.x, p.y);
    bool passed = false;
    float z = std::floor(p.value * 4);
    update(state().depth, at, [&](float &most) {
      passed = z >= most; // among equals the last
      if (passed)
        most = z;
    });
    if (passed) {
      float sum = 0;
      for (int64_t i = 0; i < state().lights.size() && i < 20; ++i)
        sum = sum * 0.5f + state().lights[i] * p.value;
      update(state().color, at,
             [&](Color &c) { c = {sum, float(p.serial), p.value}; });
    }
  }
};
struct Points : Alone<PointsStage> {};

// A second stage shades when all primitives of the bin are there.
struct Fragment {
  int x, y;
  float z;
  int serial;
};
struct Splitter : piko::Stage<small, small, 64, Particle, Fragment> {
  void assignBin(const Particle &p) {
    if (p.x >= 0 && p.y >= 0 && p.x < domain().x && p.y < domain().y)
      assignToBin(p, binFromPosition(glm::ivec2(p.x, p.y)));
  }
  void process(const Particle &p) {
    for (int i = 0; i < p.serial % 4; ++i)
      emit(Fragment{p.x, p.y, p.value + i % 2, p.serial + i}, 0);
  }
};
struct Shader : piko::Stage<small, small, 64, Fragment>, piko::Uses<State> {
  void assignBin(const Fragment &f) {
    assignToBin(f, binFromPosition(glm::ivec2(f.x, f.y)));
  }
  void schedule(piko::BinId) { endBin(); }
  void process(const Fragment &f) {
    float sum = 0;
    for (int64_t i = 0; i < state().lights.size() && i < f.serial % 7; ++i)
      sum += std::sqrt(std::abs(state().lights[i])) * f.z;
    bool passed = false;
    update(state().depth, {f.x, f.y}, [&](float &most) {
      passed = f.z > most;
      if (passed)
        most = f.z;
    });
    if (passed)
      update(state().color, {f.x, f.y},
             [&](Color &c) { c = {sum, f.z, float(f.serial)}; });
  }
};
struct Behind : piko::Pipe<State> {
  Splitter splitter;
  Shader shader;
  Behind() {
    source(splitter);
    connect(splitter, 0, shader);
    allocateForSource(state().lights, 0);
  }
};

// What is read at a computed place for each pixel.
struct PictureStage : Discs<> {
  void process(const Particle &p) {
    parallelForPixels(lo(p), hi(p), [&](glm::ivec2 at) {
      float z = depthAt(p, at);
      bool passed = false;
      update(state().depth, at, [&](float &most) {
        passed = z > most;
        if (passed)
          most = z;
      });
      if (passed) {
        int64_t size = state().lights.size();
        int64_t texel = (int64_t(at.x) * 7 + p.serial) % size;
        float color = 0;
        for (int k = 0; k < 12; ++k)
          color += state().lights[(texel + k * at.y) % size] / (k + 1);
        update(state().color, at, [&](Color &c) { c.r = color; });
      }
    });
  }
};
struct Picture : Alone<PictureStage> {};

// Numbers of other kinds are kept.
struct KindsStage : Discs<> {
  void process(const Particle &p) {
    parallelForPixels(lo(p), hi(p), [&](glm::ivec2 at) {
      double z = double(p.value) / 3 + at.x;
      int16_t narrow = int16_t(p.serial * 5 - at.y);
      int64_t wide = int64_t(p.serial) << 33 | at.x;
      bool flag = (p.serial ^ at.x) % 3 == 1;
      bool passed = false;
      update(state().depth, at, [&](float &most) {
        passed = float(z) > most;
        if (passed)
          most = float(z);
      });
      if (passed) {
        double sum = 0;
        for (int k = 0; k < 8; ++k) {
          sum += flag ? z * k : double(narrow) / (k + 1);
          sum -= double(wide >> (30 + k));
        }
        update(state().color, at, [&](Color &c) { c.r = float(sum); });
      }
    });
  }
};
struct Kinds : Alone<KindsStage> {};

// A phase that takes the bin's list.
struct ListsStage : piko::Stage<large, large, 64, Particle>, piko::Uses<State> {
  void assignBin(const Particle &p) {
    assignToBoundingBox(p, glm::ivec2(p.x, p.y) - 3, glm::ivec2(p.x, p.y) + 3);
  }
  void process(const piko::List<Particle> &list) {
    for (int64_t i = 0; i < list.size(); ++i) {
      const Particle &p = list[i];
      parallelForPixels(glm::ivec2(p.x, p.y) - 3, glm::ivec2(p.x, p.y) + 3,
                        [&](glm::ivec2 at) {
                          float sum = p.value;
                          for (int k = 0; k < at.x + 3; ++k)
                            sum = sum * 0.75f + float(p.serial);
                          update(state().color, at,
                                 [&](Color &c) { c.b = sum; });
                        });
    }
  }
};
struct Lists : Alone<ListsStage> {};

// What a pixel was counts: each primitive has its part in it.
struct CountsStage : Discs<> {
  void process(const Particle &p) {
    parallelForPixels(lo(p), hi(p), [&](glm::ivec2 at) {
      float sum = shade(p.value, float(at.x));
      update(state().color, at, [&](Color &c) {
        c.r = c.r * 0.5f + sum;
        c.g = sum;
      });
    });
  }
};
struct Counts : Alone<CountsStage> {};
