// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// References, pointers and numbers: a reference to one of several things,
// pointers that walk through an array, a table, a vector indexed by a variable,
// conversions out of range, comparisons with NaN, shifts and 64-bit integers,
// unions, functions passed by pointer, and what an update returns.
// RUN: %compare_targets %s --count 3000 | FileCheck %s
// CHECK: equal
#include "../Inputs/ports.h"

#include <algorithm>
#include <array>
#include <cmath>

struct Sample {
  float value;
  int index;
  glm::vec4 v;
  double d;
  bool flag;
  uint8_t bytes[3];
  uint32_t bits;
  int64_t wide;
};
struct Entry {
  float weight[2][3];
  glm::mat3 m;
  int count;
};
struct Out {
  glm::ivec2 at;
  float x;
  int64_t n;
};
enum class Mode : int { Plus, Minus, Other };
struct Nested {
  float base;
  Entry entries[3];
};
struct State {
  float bias;
  Mode mode;
  Nested nested;
  piko::Buffer<Sample> samples;
  piko::Buffer<Entry> entries;
  piko::Buffer<float> results;
  piko::Buffer<int64_t> sums;
  piko::Image<float> image;
};

static const float table[5] = {1, 2, 4, 8, 16};

inline float half(float x) { return x * 0.5f; }
inline float square(float x) { return x * x; }
inline float apply(float (*f)(float), float x) { return f(x) + f(-x); }

template <class T> struct Range {
  T *first, *last;
  T *begin() const { return first; }
  T *end() const { return last; }
};

struct Compute : piko::Stage<0, 0, 64, Sample, Out>, piko::Uses<State> {
  float scale = 3;

  float references(const Sample &s) {
    const Sample &one = s.flag ? state().samples[s.index] : s;
    float sum = std::max(one.value, 0.5f) + std::min(one.v.y, state().bias);
    const float *best = &s.v.x;
    if (s.v.y > *best)
      best = &s.v.y;
    if (s.v.z > *best)
      best = &s.v.z;
    glm::vec4 v = s.v;
    v[s.index & 3] = 2.0f;
    (s.flag ? v.x : v.w) += 1.0f;
    float &cell = s.index > 30 ? v.y : s.index > 10 ? v.z : v.x;
    cell *= 3;
    std::swap(v.x, v.y);
    return sum + *best + v.x + v.y * 2 + v.z * 4 + v.w * 8 + s.v[s.index % 4];
  }

  float walks(const Sample &s) {
    float sum = 0;
    for (float w : state().nested.entries[1].weight[s.index & 1])
      sum += w;
    std::array<float, 4> local{1, 2, 3, 4};
    for (float &w : local)
      w *= s.value;
    for (auto w = local.begin(); w != local.end(); ++w)
      sum += *w;
    Range<const float> range{local.data() + 1,
                             local.data() + (s.index & 3) + 1};
    for (float w : range)
      sum -= w;
    Entry copy = state().nested.entries[s.index % 3];
    copy.weight[1][s.index % 3] += 5;
    for (int i = 0; i < 2; ++i)
      for (int j = 0; j < 3; ++j)
        sum +=
            copy.weight[i][j] * state().nested.entries[j].weight[i][s.bytes[1]];
    glm::vec3 r = copy.m * glm::vec3(s.v) + state().nested.entries[2].m[1];
    return sum + glm::length(r) + table[s.index % 5] + table[(s.bits >> 3) % 5];
  }

  int64_t numbers(const Sample &s) {
    float huge = s.value * 1e18f, nan = (s.value - s.value) / 0.0f;
    int64_t n = piko::toInt64(huge) + piko::toInt(huge) + piko::toUint(-huge) +
                piko::toInt(nan) + int64_t(s.value) + int64_t(s.d * 1e3);
    n ^= (s.wide << (s.index & 31)) >> 3;
    n += int64_t(uint64_t(s.wide * 0x9e3779b97f4a7c15ull) >> 40);
    n += s.index / (s.bits + 1) + s.index % 7 - (s.index - 40) / 7;
    n += (s.bits << 5 | s.bits >> 27) + __builtin_popcount(s.bits);
    n += std::isnan(nan) + 2 * std::isinf(huge * huge) + 4 * (nan < huge);
    n += std::abs(s.index - 20) + int64_t(std::floor(-s.value * 0.3f)) +
         int64_t(std::round(s.value)) * 3 + int64_t(std::trunc(s.d));
    union {
      float f;
      uint32_t u;
    } pun;
    pun.f = s.value;
    return n + int64_t(pun.u >> 9) + __builtin_bit_cast(int32_t, s.v.x);
  }

  void process(const Sample &s) {
    Out out{};
    out.x = references(s) + walks(s);
    out.n = numbers(s);
    out.x += apply(s.flag ? half : half, s.value) + apply(square, s.value);
    out.x = glm::mix(out.x, scale, 0.25f) + glm::clamp(s.value, 0.f, 1.f) +
            glm::smoothstep(0.f, 40.f, s.value) + glm::fract(s.value);
    glm::vec3 r = glm::min(glm::max(glm::vec3(s.v), 0.0f), glm::vec3(1));
    out.x += glm::cross(r, glm::vec3(s.v)).y + glm::reflect(r, r).x;
    switch (state().mode) {
    case Mode::Plus:
      out.n++;
      [[fallthrough]];
    case Mode::Minus:
      out.n -= 2;
      break;
    case Mode::Other:
      if (s.index == 5)
        return;
    }
    for (int i = 0; i < s.index; ++i) {
      if (i * i > 500)
        break;
      for (int j = 0;; ++j) {
        if (j == i)
          continue;
        if (j * i > 7)
          goto done;
        if (j > 9)
          break;
        out.n += j;
      }
    }
  done:
    out.at = glm::ivec2(s.index, s.bits % 48);
    emit(out);
  }
};

struct Gather : piko::Stage<16, 8, 64, Out>, piko::Uses<State> {
  void assignBin(const Out &o) {
    if (o.n & 1)
      assignToBin(o, binFromPosition(o.at));
    else
      assignToBoundingBox(o, glm::vec2(o.at) - 9.5f, glm::vec2(o.at) + 3.0f);
  }
  void process(const Out &o) {
    glm::ivec2 lo = binLo(), hi = binHi();
    glm::ivec2 at = glm::clamp(o.at, lo, hi - 1);
    float before = update(state().image, at, [&](float &p) {
      float old = p;
      p = old * 0.5f + float(o.n & 1023) + (o.x > old ? 1.0f : -1.0f);
      return old;
    });
    piko::atomicAdd(state().sums[bin().index & 63],
                    o.n + (before > 3 ? 1000 : 0) + domain().x);
  }
};

struct References : piko::Pipe<State> {
  Compute compute;
  Gather gather;
  References() {
    compute.scale = 5;
    source(compute);
    connect(compute, 0, gather);
  }
};
