// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Blocks of a GPU share a bin that is the whole domain where its primitives select
// what pixels keep: the texts are those of selections.cpp, and some whose keys are
// wide, or whose kernels do more than select.
// REQUIRES: all
// RUN: piko-compare %S/selections.cpp --cases %S/selections.cpp --runs 1 --threads 2 --target gpu-on-cpu --gpu-threads 32 --gpu-seed 3
// RUN: %compare_targets %s --cases %s --runs 1
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_SEED=5 piko-compare %s --cases %s --runs 2 --threads 2 --target cuda
// CASE: --pipe Far --count 3000 --domain 67 35
// CASE: --pipe Wider --count 3000 --domain 67 35
// CASE: --pipe Ties --count 3000 --domain 67 35
// CASE: --pipe Emitting --count 3000 --domain 67 35
// CASE: --pipe Serial --count 900 --domain 67 35
// What reads what other primitives store is in no order on the threads of a CPU.
// RUN: env PIKO_CUDA_DRIVER=%test_driver PIKO_TEST_DRIVER_SEED=5 piko-compare %s --pipe Reading --count 900 --domain 67 35 --runs 2 --threads 2 --target cuda
// CASE: --pipe Tiles --count 900 --domain 67 35
// CASE: --pipe Tiles --count 4 --domain 670 350
// CASE: --pipe TilesByTwo --count 900 --domain 67 35
// CASE: --pipe TileSums --count 900 --domain 67 35
// CASE: --pipe TilesGoOn --count 900 --domain 67 35
// CASE: --pipe TilesBlend --count 900 --domain 67 35
// With a budget the frame is the host's, which clears what the kernels have for
// themselves before each launch.
// RUN: env PIKO_CUDA_DRIVER=%test_driver piko-compare %S/selections.cpp --pipe Rounds --count 3000 --domain 67 35 --runs 2 --threads 2 --target cuda --budget 50000000 | FileCheck %s --check-prefix=HOST
// RUN: env PIKO_CUDA_DRIVER=%test_driver piko-compare %s --pipe Tiles --count 900 --domain 67 35 --runs 2 --threads 2 --target cuda --budget 50000000 | FileCheck %s --check-prefix=HOST
// HOST: {{^equal$}}
// RUN: env PIKO_CUDA_DRIVER=%test_driver not piko-compare %S/selections.cpp --pipe Outside --count 4000 --runs 1 --target cuda | FileCheck %s --check-prefix=OUTSIDE
// OUTSIDE: run 0: got: stage 'draw', bin 0: expected an update inside the stage's own bin
// RUN: pikoc %S/selections.cpp --pipe Nearest --target cuda --remarks -o %t.o 2>&1 | FileCheck %s --check-prefix=NEAREST
// NEAREST: stage 'draw' finds out by atomic operations which primitive a pixel is of, and then changes: 'depth', 'color'
// RUN: pikoc %s --pipe Wider --target cuda --remarks -o %t.o 2>&1 | FileCheck %s --check-prefix=WIDER
// WIDER: stage 'draw' runs its only bin in one block
// WIDER: note: its key and the position of a primitive take more than two words of 64 bits; let it have fewer or narrower numbers
// RUN: pikoc %s --pipe Tiles --target cuda --remarks -o %t.o 2>&1 | FileCheck %s --check-prefix=TILES
// TILES: stage 'draw' finds out by atomic operations which primitive a pixel is of, and then changes: 'wide', 'far'
// RUN: pikoc %s --pipe TilesBlend --target cuda --remarks -o %t.o 2>&1 | FileCheck %s --check-prefix=BLEND
// BLEND: stage 'draw' runs a bin on one thread
// BLEND: note: the pixel becomes something that depends on what it was
// RUN: pikoc %s --pipe Reading --target cuda --remarks -o %t.o 2>&1 | FileCheck %s --check-prefix=READING
// READING: stage 'draw' runs its only bin in one block
// READING: note: this reads what the stage writes; read what another stage has written
#include "../Inputs/ports.h"

#include <limits>

struct Far64 {
  double z = -5;
  uint8_t of = 0;
};
struct Wide {
  float z = 30;
  int group = 7;
  int64_t id = 0;
};
struct Count {
  int value = 0;
};
struct State {
  piko::Image<Far64> far;
  piko::Image<Wide> wide;
  piko::Image<Count> sums;
  piko::Buffer<Count> own;
};

template <class Draw> struct Pipe : piko::Pipe<State> {
  Draw draw;
  Pipe() { source(draw); }
};

/// Stages that do something for each pixel of a box.
struct Boxes : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void forBox(const Point &p, auto &&body) const {
    for (int y = std::max(p.y, 0); y < std::min(p.y + p.tag % 5, domain().y);
         ++y)
      for (int x = std::max(p.x, 0); x < std::min(p.x + p.tag % 7, domain().x);
           ++x)
        body(glm::ivec2(x, y));
  }
};

/// A key of 64 bits, the greatest, and the last among equal ones.
struct DrawFar : Boxes {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 q) {
      int k = (p.tag * 77 + q.x) % 23;
      double z = k == 5   ? std::numeric_limits<double>::quiet_NaN()
                 : k == 6 ? -0.0
                          : k - 11.25;
      update(state().far, q, [&](Far64 &f) {
        if (z >= f.z) {
          f.z = z;
          f.of = uint8_t(p.tag);
        }
      });
    });
  }
};
struct Far : Pipe<DrawFar> {};

/// A key that is wider than two words stays in order.
struct DrawWider : Boxes {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 q) {
      float z = float((p.tag * 7 + q.y) % 5);
      int group = p.tag % 3 * 5;
      int64_t id = int64_t(p.tag) * 1'000'003 % 77;
      update(state().wide, q, [&](Wide &w) {
        if (z < w.z || (z == w.z &&
                        (group < w.group || (group == w.group && id > w.id)))) {
          w.z = z;
          w.group = group;
          w.id = id;
        }
      });
    });
  }
};
struct Wider : Pipe<DrawWider> {};

/// Each primitive comes to a pixel several times, with the same key and not.
struct DrawTies : Boxes {
  void process(const Point &p) {
    for (int turn = 0; turn < 3; ++turn)
      forBox(p, [&](glm::ivec2 q) {
        float z = float((p.tag + turn / 2) % 4);
        bool nearer = false;
        update(state().wide, q, [&](Wide &w) {
          if (z < w.z) {
            w.z = z;
            w.id = turn * 10000 + p.tag;
            nearer = true;
          }
        });
        if (nearer)
          update(state().far, q, [&](Far64 &f) { f.of = uint8_t(turn + 1); });
        update(state().sums, q, [&](Count &c) { c.value += turn; });
      });
  }
};
struct Ties : Pipe<DrawTies> {};

/// What it emits comes once.
struct DrawEmitting : piko::Stage<0, 0, 64, Point, Point>, piko::Uses<State> {
  void process(const Point &p) {
    glm::ivec2 q =
        glm::clamp(glm::ivec2(p.x, p.y) % 8, glm::ivec2(0), domain() - 1);
    float z = float(p.tag % 13);
    update(state().wide, q, [&](Wide &w) {
      if (z <= w.z) {
        w.z = z;
        w.id = p.tag;
      }
    });
    if (p.tag & 1)
      emit(Point{p.x, p.y, p.value, p.tag + 1});
  }
};
struct Last : piko::Stage<8, 8, 64, Point>, piko::Uses<State> {
  glm::ivec2 placeOf(const Point &p) const {
    return glm::clamp(glm::ivec2(p.x, p.y) % 3, glm::ivec2(0), domain() - 1);
  }
  void assignBin(const Point &p) {
    assignToBin(p, binFromPosition(glm::vec2(placeOf(p))));
  }
  void process(const Point &p) {
    glm::ivec2 q = placeOf(p);
    update(state().far, q, [&](Far64 &f) { f.of = uint8_t(f.of * 3 + p.tag); });
  }
};
struct Emitting : piko::Pipe<State> {
  DrawEmitting draw;
  Last last;
  Emitting() {
    source(draw);
    connect(draw, 0, last);
  }
};

/// One core was asked for.
struct DrawSerial : Boxes {
  void schedule(piko::BinId) { specifySchedule(piko::Serialize); }
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 q) {
      float z = float(p.tag % 13);
      update(state().wide, q, [&](Wide &w) { w.z = std::min(w.z, z); });
    });
  }
};
struct Serial : Pipe<DrawSerial> {};

/// Cannot be done twice.
struct DrawReading : Boxes {
  void process(const Point &p) {
    int place = p.tag * 2 % 64;
    state().own[place].value = p.x;
    state().own[place + 1].value = p.y;
    int sum = 0;
    for (int i = 0; i < 1 + p.tag % 2; ++i)
      sum += state().own[place + i].value;
    float z = float(sum);
    forBox(p, [&](glm::ivec2 q) {
      update(state().wide, q, [&](Wide &w) {
        if (z < w.z)
          w.z = z;
      });
    });
  }
};
struct Reading : Pipe<DrawReading> {};

//===----------------------------------------------------------------------===//
// After a local edge, where the threads of a block share what has come
//===----------------------------------------------------------------------===//

/// Fragments of a box in a bin.
struct Spread : piko::Stage<16, 16, 64, Point, Point>, piko::Uses<State> {
  void assignBin(const Point &p) {
    assignToBoundingBox(p, glm::ivec2(p.x, p.y), glm::ivec2(p.x + 4, p.y + 3));
  }
  void process(const Point &p) {
    glm::ivec2 lo = glm::max(glm::ivec2(p.x, p.y), binLo()),
               hi = glm::min(glm::ivec2(p.x + 4, p.y + 3), binHi());
    for (int y = lo.y; y < hi.y; ++y)
      for (int x = lo.x; x < hi.x; ++x)
        emit(Point{x, y, p.value, p.tag * 7 + x % 3});
  }
};

struct InTile : piko::Stage<16, 16, 64, Point>, piko::Uses<State> {
  void assignBin(const Point &p) { assignToPreviousBins(p); }
  void schedule(piko::BinId) { endBin(); }
};
template <class Draw> struct TilePipe : piko::Pipe<State> {
  Spread spread;
  Draw draw;
  TilePipe() {
    source(spread);
    connect(spread, 0, draw);
  }
};

struct DrawTile : InTile {
  void process(const Point &p) {
    float z = float(p.tag % 23);
    bool nearer = false;
    update(state().wide, {p.x, p.y}, [&](Wide &w) {
      nearer = z <= w.z;
      if (nearer)
        w.z = z;
    });
    if (!nearer)
      return;
    int sum = 0;
    for (int i = 0; i < 3 + p.tag % 5; ++i)
      sum = sum * 3 + p.tag;
    update(state().far, {p.x, p.y}, [&](Far64 &f) { f.of = uint8_t(sum); });
  }
};
struct Tiles : TilePipe<DrawTile> {};

struct DrawTileByTwo : InTile {
  void process(const Point &p) {
    float z = float(p.tag % 5);
    int group = p.tag * 31 % 7;
    update(state().wide, {p.x, p.y}, [&](Wide &w) {
      if (z < w.z || (z == w.z && group > w.group)) {
        w.z = z;
        w.group = group;
        w.id = p.tag;
      }
    });
  }
};
struct TilesByTwo : TilePipe<DrawTileByTwo> {};

struct DrawTileSums : InTile {
  void process(const Point &p) {
    update(state().sums, {p.x, p.y}, [&](Count &c) { c.value += p.tag; });
  }
};
struct TileSums : TilePipe<DrawTileSums> {};

/// What it emits goes on to another bin.
struct DrawTileGoOn : piko::Stage<16, 16, 64, Point, Point>, piko::Uses<State> {
  void assignBin(const Point &p) { assignToPreviousBins(p); }
  void schedule(piko::BinId) { endBin(); }
  void process(const Point &p) {
    float z = float(p.tag % 11);
    update(state().wide, {p.x, p.y}, [&](Wide &w) {
      if (z < w.z) {
        w.z = z;
        w.id = p.tag;
      }
    });
    if (p.tag % 3)
      emit(Point{p.y, p.x, p.value, p.tag});
  }
};
struct TilesGoOn : piko::Pipe<State> {
  Spread spread;
  DrawTileGoOn draw;
  Last last;
  TilesGoOn() {
    source(spread);
    connect(spread, 0, draw);
    connect(draw, 0, last);
  }
};

/// Order that shows.
struct DrawTileBlend : InTile {
  void process(const Point &p) {
    update(state().sums, {p.x, p.y},
           [&](Count &c) { c.value = c.value * 3 + p.tag; });
  }
};
struct TilesBlend : TilePipe<DrawTileBlend> {};
