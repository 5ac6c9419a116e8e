// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Storage of which a part is written before anything is read: the bits beside it
// are those of another field, which is not written yet, and what is read is what was
// written, in parallel loops as elsewhere.
// RUN: %compare_targets %s --cases %s --runs 1
// CASE: --pipe Pixels --domain 19 13 --count 3
// CASE: --pipe Flags --domain 19 13 --count 3
// CASE: --pipe Wide --domain 19 13 --count 3
// CASE: --pipe Arrays --domain 19 13 --count 3
// CASE: --pipe Branches --domain 19 13 --count 3
// CASE: --pipe Iterations --count 40
// CASE: --pipe Meets --count 20
// CASE: --pipe Bytes --domain 19 13 --count 3
// CASE: --pipe Alone --count 40
#include <cstdint>
#include <cstring>
#include <piko.h>

struct State {
  piko::Image<int> out;
  piko::Buffer<int> list;
};

template <class Body>
struct OfPixels : piko::Stage<8, 8, 1, int>, piko::Uses<State> {
  void assignBin(const int &i) { this->assignToAll(i); }
  void process(const int &i) {
    this->parallelForPixels([&](glm::ivec2 at) {
      int v = Body::of(at, i);
      this->update(this->state().out, at, [&](int &p) { p = p * 31 + v; });
    });
  }
};
template <class Stage> struct One : piko::Pipe<State> {
  Stage stage;
  One() { this->source(stage); }
};

struct Signed {
  static int of(glm::ivec2 at, int i) {
    struct {
      int s : 4;
    } f;
    f.s = at.x + i;
    return f.s;
  }
};
struct Pixels : One<OfPixels<Signed>> {};

struct Packed {
  bool odd : 1, far : 1;
  uint8_t rest : 6;
};
inline void mark(Packed &flags, glm::ivec2 at) {
  flags.odd = at.x & 1;
  flags.far = at.y > 6;
}
struct Marked {
  static int of(glm::ivec2 at, int i) {
    Packed flags;
    mark(flags, at);
    flags.rest = uint8_t(at.x * 3 + i);
    return flags.odd + 2 * flags.far + 4 * flags.rest;
  }
};
struct Flags : One<OfPixels<Marked>> {};

struct Units {
  static int of(glm::ivec2 at, int i) {
    struct {
      uint32_t a : 20, b : 20;
      uint64_t c : 40, d : 9;
      int16_t e : 5;
    } u;
    u.c = uint64_t(at.x) << 33 | unsigned(i);
    u.b = unsigned(at.y) << 15;
    u.e = int16_t(at.x - at.y);
    u.a = 77u * unsigned(at.x);
    return int(u.a ^ u.b) + int(u.c >> 33) + u.e;
  }
};
struct Wide : One<OfPixels<Units>> {};

struct Elements {
  static int of(glm::ivec2 at, int) {
    struct Element {
      unsigned low : 3, high : 7;
    };
    Element all[4];
    for (int k = 0; k < 4; ++k)
      all[k].high = unsigned(at.x * (k + 2));
    for (int k = 0; k < 4; ++k)
      all[k].low = unsigned(at.y + k);
    int sum = 0;
    for (const Element &element : all)
      sum = sum * 5 + int(element.high + element.low);
    return sum;
  }
};
struct Arrays : One<OfPixels<Elements>> {};

struct Chosen {
  static int of(glm::ivec2 at, int i) {
    struct {
      int a : 6, b : 6;
    } f;
    if ((at.x ^ at.y) & 1)
      f.a = at.x;
    else
      f.b = at.y + i;
    return (at.x ^ at.y) & 1 ? f.a : f.b;
  }
};
struct Branches : One<OfPixels<Chosen>> {};

struct ForItems : piko::Stage<0, 0, 8, int>, piko::Uses<State> {
  void process(const int &input) {
    int i = input & 7; // equal ones store the same
    parallelFor(5, [&](int k) {
      struct {
        int a : 9, b : 3;
      } f;
      f.a = i * 3 + k;
      f.b = k;
      state().list[5 * i + k] = f.a * 8 + f.b;
    });
  }
};
struct Iterations : One<ForItems> {};

struct WithBarriers : piko::Stage<0, 0, 8, int>, piko::Uses<State> {
  void process(const int &input) {
    int i = input & 7;
    parallelFor(4, [&](int k) {
      struct {
        unsigned a : 5, b : 5;
      } f;
      f.b = unsigned(i + k);
      sync();
      f.a = unsigned(i * k);
      state().list[4 * i + k] = int(f.a * 32 + f.b);
    });
  }
};
struct Meets : One<WithBarriers> {};

struct Parts {
  static int of(glm::ivec2 at, int i) {
    union {
      uint32_t whole;
      uint8_t bytes[4];
    } u;
    u.bytes[1] = uint8_t(at.x + i);
    u.bytes[3] = uint8_t(at.y);
    uint64_t w;
    uint16_t half = uint16_t(at.x * 500);
    std::memcpy(reinterpret_cast<char *>(&w) + 2, &half, sizeof half);
    return int(u.whole >> 8 & 255) + int(u.whole >> 24) + int(w >> 16 & 0xffff);
  }
};
struct Bytes : One<OfPixels<Parts>> {};

struct Outside : piko::Stage<0, 0, 8, int>, piko::Uses<State> {
  void process(const int &input) {
    int i = input & 63;
    Packed flags;
    flags.rest = uint8_t(i);
    for (int k = 0; k < 3; ++k)
      flags.odd = (i >> k) & 1;
    state().list[i] = flags.rest * 2 + flags.odd;
  }
};
struct Alone : One<Outside> {};
