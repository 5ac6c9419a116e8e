// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Iterations that run as lanes of vectors keep their order where it shows: they
// emit, update pixels that they share, meet, and read the items of lists.
// REQUIRES: all
// RUN: %compare_targets %s --cases %s --runs 1
// CASE: --pipe Emits --domain 67 35 --count 320
// CASE: --pipe EmitsInLoops --domain 67 35 --count 320
// CASE: --pipe Rows --domain 67 35 --count 320
// CASE: --pipe Shares --domain 67 35 --count 320
// CASE: --pipe Neighbours --domain 67 35 --count 320
// CASE: --pipe Shifts --domain 67 35 --count 320
// CASE: --pipe Meets --domain 67 35 --count 320
// CASE: --pipe Nests --domain 67 35 --count 320
// CASE: --pipe Lists --domain 67 35 --count 320
// RUN: piko-compare %s --cases %s --runs 1 --without vectorize -O0
//
// RUN: pikoc %s --pipe EmitsInLoops,Rows,Shares --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=VECTORS
// VECTORS-COUNT-3: .cpp:[[#]]:{{[0-9]+}}: remark: stage '{{.*}}': these iterations are vectorized for {{4|8}} at once
// VECTORS-NOT: .cpp:[[#]]:{{[0-9]+}}: remark: stage '{{.*}}': these iterations are vectorized for {{4|8}} at once
#include "../Inputs/vector-iterations.h"

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

// Each iteration updates its pixel and the next one's: two lanes meet there.
struct Neighbour : piko::Stage<32, 8, 64, Item>, piko::Uses<State> {
  void assignBin(const Item &p) {
    assignToBin(p, binFromPosition(wrap(p.x, p.y, domain())));
  }
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::Iterations); }
  void process(const Item &p) {
    int y = wrap(p.x, p.y, domain()).y;
    parallelFor(binHi().x - binLo().x - 1, [&](int i) {
      float value = p.value + float(i);
      for (int k = 0; k < 3; ++k)
        value = value * value * 0.01f + float(k);
      int x = binLo().x + i;
      update(state().picture, glm::ivec2(x, y),
             [&](Pixel &pixel) { pixel.sum = pixel.sum * 0.5f + value; });
      update(state().picture, glm::ivec2(x + 1, y), [&](Pixel &pixel) {
        pixel.sum = pixel.sum * 0.25f - value;
        pixel.count = pixel.count * 3 + i;
      });
    });
  }
};
struct Neighbours : piko::Pipe<State> {
  Neighbour stage;
  Neighbours() { source(stage); }
};

// The same, in different iterations of an inner loop.
struct Shift : piko::Stage<32, 8, 64, Item>, piko::Uses<State> {
  void assignBin(const Item &p) {
    assignToBin(p, binFromPosition(wrap(p.x, p.y, domain())));
  }
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::Iterations); }
  void process(const Item &p) {
    int y = wrap(p.x, p.y, domain()).y;
    parallelFor(binHi().x - binLo().x - 2, [&](int i) {
      for (int k = 0; k < 3; ++k) {
        float value = p.value + float(i * k);
        update(state().picture, glm::ivec2(binLo().x + i + k, y),
               [&](Pixel &pixel) {
                 pixel.sum = pixel.sum * 0.5f + value;
                 pixel.count = pixel.count * 3 + i * 7 + k;
               });
      }
    });
  }
};
struct Shifts : piko::Pipe<State> {
  Shift stage;
  Shifts() { source(stage); }
};

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

// The items of a list.
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
