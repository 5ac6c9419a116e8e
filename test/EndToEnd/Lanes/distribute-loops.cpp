// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What a phase computes of a primitive before its own loops, said in many
// ways: the pixels of the reference executor, whether it is computed for many
// primitives at once or for one. What is under a condition is computed for all,
// but for what the condition says can be read.
// REQUIRES: all
// RUN: %compare_targets %s --cases %s --runs 1
// CASE: --pipe Discs --domain 167 93 --count 400
// CASE: --pipe Returns --domain 167 93 --count 400
// CASE: --pipe Ellipses --domain 167 93 --count 400
// CASE: --pipe Stripes --domain 167 93 --count 400
// CASE: --pipe Kinds --domain 167 93 --count 400
// CASE: --pipe Divides --domain 167 93 --count 400
// CASE: --pipe Narrow --domain 167 93 --count 400
// CASE: --pipe Reads --domain 167 93 --count 400
// CASE: --pipe Seldom --domain 167 93 --count 400
// CASE: --pipe Beside --domain 167 93 --count 400
// CASE: --pipe Planes --domain 167 93 --count 400
// CASE: --pipe Planes --domain 167 93 --count 1
//
// RUN: pikoc %s --pipe Discs,Ellipses,Stripes,Kinds,Divides,Narrow,Reads,Seldom,Planes --remarks --cpu x86-64-v4 --emit=target -o /dev/null 2>&1 | FileCheck %s
// CHECK-COUNT-9: remark: stage 'stage': what follows from a primitive before the loops of its iteration is computed for 16 primitives at once
// CHECK-NOT: what follows from a primitive
#include <piko.h>

struct Shape {
  int32_t x, y;
  uint16_t w, h;
  int32_t kind;
  int16_t slope;
  uint8_t gray;
  bool wide;
  float weight;
};
struct Pixel {
  uint32_t sum = 1;
};
struct Scale {
  float factor = 0.5f;
};
struct State {
  piko::Image<Pixel> image;
  piko::Buffer<Scale> scales;
  float bias = 0.25f;
};

// Pixels of a bin change in an order that shows, so lanes have iterations.
template <class Self>
struct Draw : piko::Stage<32, 32, 64, Shape>, piko::Uses<State> {
  glm::vec2 centre(const Shape &s) const {
    return glm::vec2(s.x & 127, s.y & 63);
  }
  glm::ivec2 first(const Shape &s) const {
    return glm::ivec2(this->centre(s)) - glm::ivec2(s.w % 24, s.h % 24);
  }
  glm::ivec2 last(const Shape &s) const {
    return glm::ivec2(this->centre(s)) + glm::ivec2(s.w % 24, s.h % 24);
  }
  void assignBin(const Shape &s) {
    this->assignToBoundingBox(s, this->first(s), this->last(s));
  }
  void schedule(piko::BinId) { this->specifyLanes(piko::Lanes::Iterations); }
  void mix(glm::ivec2 p, uint32_t value) {
    this->update(this->state().image, p,
                 [&](Pixel &pixel) { pixel.sum = pixel.sum * 31 + value; });
  }
  template <class Body> void each(const Shape &s, Body body) {
    this->parallelForPixels(this->first(s), this->last(s), body);
  }
};
template <class Stage> struct Pipe : piko::Pipe<State> {
  Stage stage;
  Pipe() { this->source(stage); }
};

inline float lengthOf(float x, float y) { return glm::sqrt(x * x + y * y); }

struct DrawDiscs : Draw<DrawDiscs> {
  void process(const Shape &s) {
    glm::vec2 c = centre(s);
    float radius = lengthOf(float(s.w % 24), float(s.h % 24)) * 0.6f;
    float inner = radius / (1.5f + glm::abs(float(s.slope)) / 32768.0f);
    float outerSquare = radius * radius, innerSquare = inner * inner;
    float scale = 255.0f / (outerSquare + 1.0f), bias = radius / 3.0f;
    each(s, [&](glm::ivec2 p) {
      glm::vec2 d = glm::vec2(p) - c;
      float square = d.x * d.x + d.y * d.y;
      if (square < outerSquare && square >= innerSquare)
        mix(p, uint32_t(square * scale + bias));
    });
  }
};
struct Discs : Pipe<DrawDiscs> {};

// A test, and what is left of the phase after it.
struct DrawReturns : Draw<DrawReturns> {
  void process(const Shape &s) {
    float a = lengthOf(float(s.w), float(s.h)), b = float(s.slope) / (a + 1.0f);
    float area = a * 0.5f + b * b - float(s.kind % 100);
    if (!(area > 0))
      return;
    float root = glm::sqrt(area), part = 1.0f / (root + 2.0f);
    float far = root * part * 31.0f, near = far * 0.25f, all = far / (near + 1);
    each(s, [&](glm::ivec2 p) {
      float at = float(p.x & 31) * part + near * float(p.y & 3);
      if (at < far)
        mix(p, uint32_t(at * all));
    });
  }
};
struct Returns : Pipe<DrawReturns> {};

// A lambda, a struct with a constructor, vectors of GLM.
struct Conic {
  glm::vec2 centre, axes;
  float turn;
  Conic(glm::vec2 centre, const Shape &s)
      : centre(centre),
        axes(1.0f / (1.0f + float(s.w % 24)), 1.0f / (1.0f + float(s.h % 24))),
        turn(float(s.slope) / 32768.0f) {}
  float at(glm::vec2 p) const {
    glm::vec2 d = (p - centre) * axes;
    return d.x * d.x + d.y * d.y + turn * d.x * d.y;
  }
};
struct DrawEllipses : Draw<DrawEllipses> {
  void process(const Shape &s) {
    Conic conic(centre(s), s);
    auto norm = [](glm::vec2 v) { return v.x * v.x + v.y * v.y; };
    float ink = 200.0f / (1.0f + norm(conic.axes)),
          rim = glm::sqrt(norm(conic.axes));
    each(s, [&](glm::ivec2 p) {
      if (float value = conic.at(glm::vec2(p)); value < 1 - rim * 0.125f)
        mix(p, uint32_t(value * ink));
    });
  }
};
struct Ellipses : Pipe<DrawEllipses> {};

// Edges in integers of 64 bits.
struct DrawStripes : Draw<DrawStripes> {
  void process(const Shape &s) {
    int64_t a = int64_t(s.slope) * s.h, b = int64_t(s.w) * s.kind;
    int64_t c = a * 3 - b * 7, d = (a ^ b) | 1, e = c * c - d * 11;
    int64_t f = (e >> 3) + a * d, g = f - e * b + (c << 2), h = g * 5 - f;
    each(s, [&](glm::ivec2 p) {
      int64_t value = a * p.x + b * p.y + h;
      if (((value + g) & 7) != 0)
        mix(p, uint32_t(value) ^ uint32_t(e + f));
    });
  }
};
struct Stripes : Pipe<DrawStripes> {};

struct DrawKinds : Draw<DrawKinds> {
  void process(const Shape &s) {
    float a = float(s.w % 24) + 1, b = float(s.h % 24) + 1, limit = 0, step = 1;
    switch (s.kind & 3) {
    case 0:
      limit = glm::sqrt(a * b) / (a + b);
      step = a / b;
      break;
    case 1:
      limit = glm::sqrt(a * a + b * b);
      step = b / (a + 2);
      break;
    case 2:
      limit = a * b / (a + 5);
      step = limit / b;
      break;
    default:
      limit = s.wide ? a / 3 : b / 7;
      step = limit * 0.5f + a / (b + 9);
    }
    float least = limit / (step + 1), most = limit + glm::sqrt(step + 1);
    each(s, [&](glm::ivec2 p) {
      float at = float((p.x * 7 + p.y) & 63) * step;
      if (at >= least && at < most * 8)
        mix(p, uint32_t(at));
    });
  }
};
struct Kinds : Pipe<DrawKinds> {};

// Divisors that may be 0 where a condition does not hold.
struct DrawDivides : Draw<DrawDivides> {
  void process(const Shape &s) {
    int32_t part = int32_t(s.w) % 5, quotient = 3, rest = 0;
    float a = lengthOf(float(s.w), float(s.h)), b = a / (1 + float(s.h));
    float c = glm::sqrt(a + b), d = c / (a + 1), e = d * b / (c + 3);
    if (part != 0) {
      quotient = s.kind / part;
      rest = s.kind % part;
    }
    each(s, [&](glm::ivec2 p) {
      if ((p.x + quotient) % 3 != rest)
        mix(p, uint32_t(e * float(p.y) + d * float(p.x) + c + b));
    });
  }
};
struct Divides : Pipe<DrawDivides> {};

// Numbers of 8 and 16 bits, and truth values.
struct DrawNarrow : Draw<DrawNarrow> {
  void process(const Shape &s) {
    auto low = int16_t(s.slope * 3 - s.gray), high = int16_t(s.slope ^ 0x155);
    auto byte = uint8_t(s.gray * 5 + (s.w & 3)), other = uint8_t(~byte >> 1);
    bool isOdd = ((low ^ high) & 1) != 0, isWide = s.wide != isOdd;
    float a = lengthOf(float(low), float(high)), b = a / (float(byte) + 1);
    float c = glm::sqrt(a + b), d = c / (b + 2);
    each(s, [&](glm::ivec2 p) {
      if (isWide ? (p.x & 3) != (byte & 3) : uint8_t(p.y * 3) < other)
        mix(p, uint32_t(uint16_t(low)) + uint32_t(c * 0.01f + d));
    });
  }
};
struct Narrow : Pipe<DrawNarrow> {};

// State that the kernel does not change, at a place that the primitive says.
struct DrawReads : Draw<DrawReads> {
  void process(const Shape &s) {
    int64_t count = state().scales.size();
    float factor = 0.75f;
    if (count > 0)
      factor = state().scales[uint32_t(s.kind) % uint32_t(count)].factor;
    if (!(factor > 0 && factor < 100))
      factor = 2;
    float a = lengthOf(float(s.w), float(s.h)) * factor, b = a / (factor + 1);
    float c = glm::sqrt(a + b) + state().bias, d = c / (a + 1), e = b / (c + d);
    each(s, [&](glm::ivec2 p) {
      float at = float(p.x & 15) * d + float(p.y & 15) * e;
      if (at < c)
        mix(p, uint32_t(at + b * 0.001f));
    });
  }
};
struct Reads : Pipe<DrawReads> {};

// What is said to be seldom stays where it is.
struct DrawSeldom : Draw<DrawSeldom> {
  void process(const Shape &s) {
    float a = lengthOf(float(s.w % 24), float(s.h % 24)), b = 1 / (a + 1);
    float c = a * b + glm::sqrt(b), d = c / (b + 2), e = d / (c + 1);
    if (s.kind % 64 == 0) [[unlikely]] {
      for (int i = 0; i < s.w % 7; ++i)
        d = glm::sqrt(d + float(i)) / (a + 1);
    }
    each(s, [&](glm::ivec2 p) {
      if (float at = float(p.x & 7) * d + e * float(p.y & 7); at > c)
        mix(p, uint32_t(at * 16));
    });
  }
};
struct Seldom : Pipe<DrawSeldom> {};

// A list, of whose primitives each looks at the one before, if there is one.
struct DrawBeside : piko::Stage<32, 32, 64, Shape>, piko::Uses<State> {
  void assignBin(const Shape &s) {
    assignToBin(
        s, binFromPosition(glm::ivec2(uint32_t(s.x) % uint32_t(domain().x),
                                      uint32_t(s.y) % uint32_t(domain().y))));
  }
  void process(const piko::List<Shape> &shapes) {
    for (int64_t i = 0; i < shapes.size(); ++i) {
      const Shape &s = shapes[i];
      float a = lengthOf(float(s.w % 24), float(s.h % 24)), b = 1 / (a + 1);
      float c = a * b + glm::sqrt(b), d = c / (b + 2), e = d / (c + 1);
      if (i > 0) {
        const Shape &before = shapes[i - 1];
        float f = lengthOf(float(before.w % 24), float(before.h)) / (a + 1);
        d += glm::sqrt(f) * b;
        e = f / (d + 1);
      }
      parallelForPixels([&](glm::ivec2 p) {
        if (float at = float(p.x & 7) * d + e * float(p.y & 7); at > c)
          update(state().image, p, [&](Pixel &pixel) {
            pixel.sum = pixel.sum * 31 + uint32_t(at * 16);
          });
      });
    }
  }
};
struct Beside : Pipe<DrawBeside> {};

// Vectors that grow from row to row: by sums, differences, products and shifts.
struct DrawPlanes : Draw<DrawPlanes> {
  void process(const Shape &s) {
    int32_t a = s.slope * 5 - s.w, b = s.h * 3 + s.kind % 1000, c = a * b - s.w;
    int32_t d = (a << 3) ^ b, e = c * 7 - d, f = e - a * 11, g = f * d + e;
    each(s, [&](glm::ivec2 p) {
      int32_t sum = a * p.x + b * p.y + c, from = g - sum,
              twice = (sum << 1) + e;
      int32_t product = (p.x - p.y * 3) * d, other = f - (p.y << 2);
      if ((sum | product) >= 0 || (from & other) < 0)
        mix(p, uint32_t(twice) ^ uint32_t(other * 13 + product));
    });
  }
};
struct Planes : Pipe<DrawPlanes> {};
