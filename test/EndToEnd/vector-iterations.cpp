// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Iterations that run as lanes of vectors give the reference executor's numbers,
// in every style of body: loops that end at different times, arrays of an
// iteration, integers of all sizes, emission, pixels that lanes share.
// RUN: sed -n 's|^// CASE: ||p' %s > %t.cases
// RUN: piko-compare %s --cases %t.cases --runs 1 | FileCheck %s --check-prefix=EQUAL
// EQUAL-COUNT-14: {{^equal$}}
// CASE: --pipe Escapes --domain 67 35 --count 320
// CASE: --pipe Sorts --domain 67 35 --count 320
// CASE: --pipe Searches --domain 67 35 --count 320
// CASE: --pipe Bytes --domain 67 35 --count 320
// CASE: --pipe Divides --domain 67 35 --count 320
// CASE: --pipe Doubles --domain 67 35 --count 320
// CASE: --pipe Emits --domain 67 35 --count 320
// CASE: --pipe EmitsInLoops --domain 67 35 --count 320
// CASE: --pipe Rows --domain 67 35 --count 320
// CASE: --pipe Shares --domain 67 35 --count 320
// CASE: --pipe Counts --domain 67 35 --count 320
// CASE: --pipe Meets --domain 67 35 --count 320
// CASE: --pipe Nests --domain 67 35 --count 320
// CASE: --pipe Lists --domain 67 35 --count 320
// RUN: piko-compare %s --cases %t.cases --runs 1 --without vectorize-iterations | FileCheck %s --check-prefix=EQUAL
//
// RUN: pikoc %s --pipe Escapes --no-cache --remarks -o /dev/null 2>&1 | FileCheck %s --check-prefix=VECTORS
// RUN: pikoc %s --pipe Sorts --no-cache --remarks -o /dev/null 2>&1 | FileCheck %s --check-prefix=VECTORS
// RUN: pikoc %s --pipe EmitsInLoops --no-cache --remarks -o /dev/null 2>&1 | FileCheck %s --check-prefix=VECTORS
// RUN: pikoc %s --pipe Shares --no-cache --remarks -o /dev/null 2>&1 | FileCheck %s --check-prefix=VECTORS
// VECTORS: vector-iterations.cpp:[[#]]:{{[0-9]+}}: remark: these iterations are vectorized for 16 at once
#include <piko.h>

struct Item {
  int x, y;
  float value;
  int serial;
};
struct Found {
  int x, y;
  int serial, iteration, ordinal;
};
struct Pixel {
  float sum;
  int count;
};

// A cell of the domain.
inline glm::ivec2 wrap(int x, int y, glm::ivec2 size) {
  return {int(unsigned(x) % unsigned(size.x)),
          int(unsigned(y) % unsigned(size.y))};
}

struct State {
  piko::Buffer<float> floats;
  piko::Buffer<double> doubles;
  piko::Buffer<int> ints;
  piko::Image<Pixel> picture;
};

template <class S> struct Alone : piko::Pipe<State> {
  S stage;
  Alone() {
    source(stage);
    allocateForSource(state().floats, 0);
    allocateForSource(state().doubles, 0);
    allocateForSource(state().ints, 0);
  }
};

template <class Body>
struct Works : piko::Stage<16, 16, 64, Item>, piko::Uses<State> {
  void assignBin(const Item &p) {
    assignToBin(p, binFromPosition(wrap(p.x, p.y, domain())));
  }
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::Iterations); }
  void process(const Item &p) {
    if (p.serial % 64 == 0) // so that each has 64 elements
      parallelFor(37 + p.serial / 64 % 27,
                  [&](int i) { Body::run(state(), p, i, p.serial + i); });
  }
};

// Loops that end after different numbers of turns, and in the middle.
struct Escape {
  static void run(State &state, const Item &p, int i, int at) {
    float x = 0, y = 0, a = float(i) * 0.05f - 1.2f, b = p.value * 0.5f;
    int turns = 0;
    while (turns < 40 + p.serial % 7) {
      float next = x * x - y * y + a;
      y = 2 * x * y + b;
      x = next;
      ++turns;
      if (x * x + y * y > 4)
        break;
      if (turns % 3 == i % 3)
        continue;
      x = x + 0.001f;
    }
    state.floats[at] = x + y;
    state.ints[at] = turns;
  }
};
struct Escapes : Alone<Works<Escape>> {};

// An array of the iteration's own.
struct Sort {
  static void run(State &state, const Item &p, int i, int at) {
    int values[12];
    for (int k = 0; k < 12; ++k)
      values[k] = (p.serial * 31 + i * 17 + k * k * 7) % 101;
    int count = 3 + (i + p.serial) % 10;
    for (int k = 1; k < count; ++k) {
      int value = values[k], j = k;
      while (j > 0 && values[j - 1] > value) {
        values[j] = values[j - 1];
        --j;
      }
      values[j] = value;
    }
    int hash = 0;
    for (int k = 0; k < 12; ++k)
      hash = hash * 31 + values[k];
    state.ints[at] = hash;
  }
};
struct Sorts : Alone<Works<Sort>> {};

// Reads at places that differ, and a switch with cases that fall through.
struct Search {
  static void run(State &state, const Item &p, int i, int at) {
    int lo = 0, hi = int(state.floats.size()), key = (i * 97 + p.serial) % 1000;
    while (lo < hi) {
      int middle = lo + (hi - lo) / 2;
      if (middle * 3 < key * 2)
        lo = middle + 1;
      else
        hi = middle;
    }
    int sum = lo;
    switch ((i + p.serial) % 5) {
    case 0:
      sum += 5;
      break;
    case 1:
      sum *= 3;
      [[fallthrough]];
    case 2:
      sum ^= 0x55;
      break;
    case 3:
      return;
    default:
      sum = -sum;
    }
    state.ints[at] = sum;
  }
};
struct Searches : Alone<Works<Search>> {};

// Small integers, and wide ones.
struct Byte {
  static void run(State &state, const Item &p, int i, int at) {
    uint8_t a = uint8_t(i * 7), b = uint8_t(p.serial);
    int16_t c = int16_t(p.serial * 300 - i);
    uint64_t d = uint64_t(p.serial) << 33 | uint64_t(i);
    bool odd = false;
    for (int k = 0; k < 9; ++k) {
      a = uint8_t(a * 5 + b);
      c = int16_t(c >> 1 ^ a);
      d = d * 6364136223846793005ull + 1442695040888963407ull;
      odd = odd != bool(d >> 63);
      b = odd ? uint8_t(b ^ a) : uint8_t(b + 1);
    }
    state.ints[at] = int(a) + int(b) * 256 + c + int(d >> 40) + (odd ? 1 : 0);
  }
};
struct Bytes : Alone<Works<Byte>> {};

// Divisors that are 0 for lanes that do not divide.
struct Divide {
  static void run(State &state, const Item &p, int i, int at) {
    int divisor = i % 4, value = p.serial * 100 - i;
    int64_t wide = i % 3;
    int result = 0;
    if (divisor != 0)
      result = value / divisor + value % divisor;
    if (wide != 0)
      result += int((int64_t(value) << 20) / wide);
    state.ints[at] = result;
    state.floats[at] = divisor ? float(value) / float(divisor) : p.value;
  }
};
struct Divides : Alone<Works<Divide>> {};

struct DoubleSum {
  static void run(State &state, const Item &p, int i, int at) {
    double sum = p.value;
    for (int k = 0; k <= i % 9; ++k)
      sum = sum * 0.75 + double(i + k) / 3.0;
    state.doubles[at] = piko::sqrt(sum * sum + 1.0);
    state.floats[at] = float(sum);
  }
};
struct Doubles : Alone<Works<DoubleSum>> {};

struct Keeps : piko::Stage<16, 16, 64, Found>, piko::Uses<State> {
  void assignBin(const Found &p) {
    assignToBin(p, binFromPosition(wrap(p.x, p.y, domain())));
  }
  void process(const Found &p) {
    update(state().picture, wrap(p.x, p.y, domain()), [&](Pixel &pixel) {
      pixel.sum = pixel.sum * 0.5f +
                  float(p.serial * 100 + p.iteration * 10 + p.ordinal);
      pixel.count += 1;
    });
  }
};

// Emissions keep the order of iterations.
template <bool InLoops>
struct Spreads : piko::Stage<16, 16, 64, Item, Found>, piko::Uses<State> {
  void assignBin(const Item &p) {
    assignToBin(p, binFromPosition(wrap(p.x, p.y, domain())));
  }
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::Iterations); }
  void process(const Item &p) {
    parallelFor(20 + p.serial % 15, [&](int i) {
      float value = p.value;
      for (int k = 0; k < i % 5; ++k)
        value = value * 1.5f + float(k);
      int x = p.x + i, y = p.y + int(value);
      if (i % 3 != 1)
        emit(Found{x, y, p.serial, i, 0}, 0);
      if constexpr (InLoops)
        for (int k = 0; k < (i + p.serial) % 4; ++k)
          emit(Found{x + k, y, p.serial, i, k + 1}, 0);
      else if (value > 3)
        emit(Found{x, y, p.serial, i, 1}, 0);
    });
  }
};
template <bool InLoops> struct SpreadPipe : piko::Pipe<State> {
  Spreads<InLoops> spreads;
  Keeps keeps;
  SpreadPipe() {
    source(spreads);
    connect(spreads, 0, keeps);
  }
};
struct Emits : SpreadPipe<false> {};
struct EmitsInLoops : SpreadPipe<true> {};

// Rows of pixels: each lane has one of its own.
struct Row : piko::Stage<32, 8, 64, Item>, piko::Uses<State> {
  void assignBin(const Item &p) {
    assignToBoundingBox(p, glm::ivec2(p.x - 20, p.y - 2),
                        glm::ivec2(p.x + 20, p.y + 2));
  }
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::Iterations); }
  void process(const Item &p) {
    parallelForPixels(glm::ivec2(p.x - 20, p.y - 2),
                      glm::ivec2(p.x + 20, p.y + 2), [&](glm::ivec2 at) {
                        int dx = at.x - p.x, dy = at.y - p.y;
                        if (dx * dx + 60 * dy * dy > 400)
                          return;
                        float value = p.value / float(1 + dx * dx);
                        bool isMore =
                            update(state().picture, at, [&](Pixel &pixel) {
                              bool more = value > pixel.sum;
                              pixel.sum = more ? value : pixel.sum;
                              return more;
                            });
                        if (isMore)
                          update(state().picture, at, [&](Pixel &pixel) {
                            pixel.count += p.serial;
                          });
                      });
  }
};
struct Rows : piko::Pipe<State> {
  Row row;
  Rows() { source(row); }
};

// Lanes meet in a pixel: its updates keep their order.
struct Share : piko::Stage<16, 16, 64, Item>, piko::Uses<State> {
  void assignBin(const Item &p) {
    assignToBin(p, binFromPosition(wrap(p.x, p.y, domain())));
  }
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::Iterations); }
  void process(const Item &p) {
    parallelFor(40, [&](int i) {
      float value = p.value;
      for (int k = 0; k < 6; ++k)
        value = value * 0.9f + float(i * k);
      glm::ivec2 at = glm::min(binLo() + glm::ivec2(i % 3, 0), domain() - 1);
      update(state().picture, at, [&](Pixel &pixel) {
        pixel.sum = pixel.sum * 0.5f + value;
        pixel.count = pixel.count * 3 + i;
      });
    });
  }
};
struct Shares : piko::Pipe<State> {
  Share share;
  Shares() { source(share); }
};

struct Count {
  static void run(State &state, const Item &p, int i, int at) {
    int bucket = (p.serial * 13 + i * i) % int(state.ints.size());
    float weight = p.value * float(i);
    for (int k = 0; k < 4; ++k)
      weight = weight * weight + 0.25f;
    piko::atomicAdd(state.ints[bucket], weight > 10 ? 2 : 1);
  }
};
struct Counts : Alone<Works<Count>> {};

// What is between two barriers is a loop of its own.
struct Meet : piko::Stage<16, 16, 64, Item>, piko::Uses<State> {
  void assignBin(const Item &p) {
    assignToBin(p, binFromPosition(wrap(p.x, p.y, domain())));
  }
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::Iterations); }
  void process(const Item &p) {
    if (p.serial % 64 != 0)
      return;
    parallelFor(50, [&](int i) {
      float a = p.value + float(i), b = a * a - 3 * a;
      for (int k = 0; k < i % 4; ++k)
        b = b * 0.5f + a;
      int place = scan(b > 4 ? 1 : 0, [](int x, int y) { return x + y; });
      float c = b * a + float(place);
      state().floats[p.serial + i] = c * c + a;
    });
    int most = reduce<int>(
        50, [&](int i) { return (p.serial * i * 7) % 31; },
        [](int x, int y) { return x > y ? x : y; }, 0);
    state().ints[p.serial] = most;
  }
};
struct Meets : Alone<Meet> {};

struct Nest : piko::Stage<16, 16, 64, Item>, piko::Uses<State> {
  void assignBin(const Item &p) {
    assignToBin(p, binFromPosition(wrap(p.x, p.y, domain())));
  }
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::Iterations); }
  void process(const Item &p) {
    if (p.serial % 64 != 0)
      return;
    parallelFor(8, [&](int i) {
      float scale = p.value * float(i + 1);
      parallelFor(1 + (i + p.serial) % 8, [&](int j) {
        float v = scale + float(j);
        state().floats[p.serial + i * 8 + j] = v * v - scale;
      });
    });
  }
};
struct Nests : Alone<Nest> {};

// The items of a list, one for each lane.
struct Whole : piko::Stage<16, 16, 64, Item>, piko::Uses<State> {
  void assignBin(const Item &p) {
    assignToBin(p, binFromPosition(wrap(p.x, p.y, domain())));
  }
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::Iterations); }
  void process(const piko::List<Item> &items) {
    parallelFor(int(items.size()), [&](int i) {
      const Item &p = items[i];
      float value = p.value;
      for (int k = 0; k < 5; ++k)
        value = value * 0.5f + float(p.x * k);
      state().floats[p.serial] = value * value + float(i);
    });
  }
};
struct Lists : Alone<Whole> {};
