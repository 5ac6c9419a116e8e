// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Threads share a bin that is the whole domain where its primitives select what
// pixels keep, in whatever way that is written, and the first in order of lineage
// is kept among equal ones, or the last: with ties, NaN, and zeros of both signs.
// REQUIRES: all
// RUN: %compare_targets %s --cases %s --threads 1 2 3 7
// CASE: --pipe Nearest --count 6000 --domain 67 35
// CASE: --pipe Nearest --count 3 --domain 670 350
// CASE: --pipe Last --count 6000 --domain 67 35
// CASE: --pipe Most --count 6000 --domain 67 35
// CASE: --pipe Ordered --count 6000 --domain 67 35
// CASE: --pipe Painted --count 6000 --domain 67 35
// CASE: --pipe Packed --count 6000 --domain 67 35
// CASE: --pipe Glm --count 6000 --domain 67 35
// CASE: --pipe NearAndFar --count 6000 --domain 67 35
// CASE: --pipe Assigned --count 6000 --domain 67 35
// CASE: --pipe Shaded --count 6000 --domain 67 35
// CASE: --pipe Discs --count 6000 --domain 67 35
// CASE: --pipe Wide --count 6000 --domain 67 35
// CASE: --pipe Counted --count 6000 --domain 67 35
// CASE: --pipe Marked --count 6000 --domain 67 35
// CASE: --pipe Rounds --count 3000 --domain 67 35
// RUN: %if all %{ piko-compare %s --pipe Nearest --count 6000 --domain 67 35 --without vectorize -O0 | FileCheck %s --check-prefix=SCALAR %}
// SCALAR: equal
// RUN: not piko-compare %s --pipe Outside --count 4000 --runs 1 --threads 1 2 4 | FileCheck %s --check-prefix=OUTSIDE
// OUTSIDE: 2 threads, run 0: got: stage 'draw', bin 0: expected an update inside the stage's own bin
// RUN: pikoc %s --pipe Nearest --remarks -o %t.o 2>&1 | FileCheck %s --check-prefix=NEAREST
// NEAREST: stage 'draw' selects pixels of private images, which are combined when its kernel ends: 'depth', 'color'
// RUN: pikoc %s --pipe Counted --remarks -o %t.o 2>&1 | FileCheck %s --check-prefix=COUNTED
// COUNTED: stage 'draw' updates pixels of 'best' in any order, by atomic operations
// COUNTED: stage 'draw' changes private copies of 'best'
// RUN: pikoc %s --pipe NearAndFar --remarks -o %t.o 2>&1 | FileCheck %s --check-prefix=BOTH
// BOTH-DAG: combined when its kernel ends: 'depth'{{$}}
// BOTH-DAG: combined when its kernel ends: 'far'{{$}}
#include "../Inputs/ports.h"

#include <limits>

struct Depth {
  float z = 30;
};
struct Color {
  glm::vec3 rgb{0.1f};
  int unused = 5;
};
struct Both {
  int16_t kind = 3;
  float z = 40;
  uint8_t tag = 9;
};
struct Best {
  int best = 7;
  unsigned id = 100;
};
struct Key {
  uint64_t key = std::numeric_limits<uint64_t>::max();
};
struct Count {
  uint32_t of[2][2] = {};
  int64_t most = -3;
  uint32_t bits = 0;
};
struct State {
  piko::Image<Depth> depth, far;
  piko::Image<Color> color;
  piko::Image<Both> both;
  piko::Image<Best> best;
  piko::Image<Key> keys;
  piko::Image<Count> counts;
};

/// Few values, so that many are equal; some are NaN, some zeros.
inline float depthOf(const Point &p, int x) {
  int k = (p.tag * 77 + x) % 23;
  if (k == 5)
    return std::numeric_limits<float>::quiet_NaN();
  return k == 6 ? -0.0f : k == 7 ? 0.0f : float(k * 2);
}

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
template <class Draw> struct Pipe : piko::Pipe<State> {
  Draw draw;
  Pipe() { source(draw); }
};

struct DrawNearest : Boxes {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 q) {
      float z = depthOf(p, q.x);
      bool passed = false;
      update(state().depth, q, [&](Depth &d) {
        passed = z < d.z;
        if (passed)
          d.z = z;
      });
      if (passed)
        update(state().color, q,
               [&](Color &c) { c.rgb = glm::vec3(p.tag, q.x, z); });
    });
  }
};
struct Nearest : Pipe<DrawNearest> {};

struct DrawLast : Boxes {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 q) {
      float z = depthOf(p, q.y);
      update(state().both, q, [&](Both &b) {
        if (z <= b.z) {
          b.z = z;
          b.tag = uint8_t(p.tag);
        }
      });
    });
  }
};
struct Last : Pipe<DrawLast> {};

struct DrawMost : Boxes {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 q) {
      update(state().best, q,
             [&](Best &b) { b.best = std::max(b.best, p.tag * 7 % 31); });
    });
  }
};
struct Most : Pipe<DrawMost> {};

/// With its own order among equal ones.
struct DrawOrdered : Boxes {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 q) {
      int best = (p.tag * 77 + q.x) % 11;
      unsigned id = unsigned(p.tag * 31) % 97;
      update(state().best, q, [&](Best &b) {
        if (best > b.best || (best == b.best && id < b.id)) {
          b.best = best;
          b.id = id;
        }
      });
    });
  }
};
struct Ordered : Pipe<DrawOrdered> {};

struct DrawPainted : Boxes {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 q) {
      update(state().color, q,
             [&](Color &c) { c.rgb = glm::vec3(p.tag + q.x); });
    });
  }
};
struct Painted : Pipe<DrawPainted> {};

struct DrawPacked : Boxes {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 q) {
      uint64_t key = uint64_t((p.tag * 77 + q.y) % 9) << 32 | unsigned(p.x);
      update(state().keys, q, [&](Key &k) {
        if (!(k.key <= key))
          k.key = key;
      });
    });
  }
};
struct Packed : Pipe<DrawPacked> {};

struct DrawGlm : Boxes {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 q) {
      float z = depthOf(p, q.x);
      update(state().depth, q, [&](Depth &d) { d.z = glm::min(d.z, z); });
    });
  }
};
struct Glm : Pipe<DrawGlm> {};

struct DrawNearAndFar : Boxes {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 q) {
      float z = depthOf(p, q.x);
      update(state().depth, q, [z](Depth &d) {
        if (!(z < d.z))
          return;
        d.z = z;
      });
      update(state().far, q, [z](Depth &d) { d.z = d.z < z ? z : d.z; });
    });
  }
};
struct NearAndFar : Pipe<DrawNearAndFar> {};

struct DrawAssigned : Boxes {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 q) {
      Both mine{int16_t(p.tag), depthOf(p, q.x + q.y), uint8_t(q.x)};
      update(state().both, q, [&](Both &b) { b = mine.z < b.z ? mine : b; });
    });
  }
};
struct Assigned : Pipe<DrawAssigned> {};

/// Long work where the test is passed, with an array and a loop.
struct DrawShaded : Boxes {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 q) {
      float z = depthOf(p, q.x);
      update(state().both, q, [&](Both &b) {
        if (z < b.z) {
          b.z = z;
          int parts[5] = {};
          for (int i = 0; i < 7 + p.tag % 3; ++i)
            parts[(i + q.x) % 5] += i * p.tag;
          int sum = 0;
          for (int part : parts)
            sum = sum * 3 + part;
          b.kind = int16_t(sum);
        }
      });
    });
  }
};
struct Shaded : Pipe<DrawShaded> {};

/// Pixels of which some are visited twice.
struct DrawDiscs : Boxes {
  void process(const Point &p) {
    int r = p.tag % 4;
    glm::ivec2 q(0);
    q.y = -r;
    while (q.y <= r) {
      for (q.x = -r; q.x <= r; ++q.x) {
        if (q.x * q.x + q.y * q.y > r * r)
          continue;
        glm::ivec2 at =
            glm::clamp(glm::ivec2(p.x, p.y) + q, glm::ivec2(0), domain() - 1);
        float z = depthOf(p, q.x * 3 + q.y + 40);
        bool nearer = false;
        update(state().depth, at, [&](Depth &d) {
          if (d.z > z) {
            d.z = z;
            nearer = true;
          }
        });
        if (nearer) {
          update(state().color, at, [&](Color &c) {
            c.rgb = {float(p.tag), float(q.x), float(q.y)};
            c.unused = q.y;
          });
          update(state().best, at, [&](Best &b) { b.id = unsigned(p.tag); });
        }
      }
      ++q.y;
    }
  }
};
struct Discs : Pipe<DrawDiscs> {};

/// Boxes of many pixels, in lanes.
struct DrawWide : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void schedule(piko::BinId) { specifyLanes(piko::Lanes::Iterations); }
  void process(const Point &p) {
    glm::ivec2 lo = glm::max(glm::ivec2(p.x, p.y) - 20, 0);
    glm::ivec2 hi = glm::min(glm::ivec2(p.x, p.y) + p.tag % 40, domain() - 1);
    parallelForPixels(lo, hi, [&](glm::ivec2 q) {
      float z = float((p.tag * 77 + q.x * q.y) % 23);
      bool passed = false;
      update(state().depth, q, [&](Depth &d) {
        passed = z < d.z;
        if (passed)
          d.z = z;
      });
      if (passed)
        update(state().color, q,
               [&](Color &c) { c.rgb = glm::vec3(p.tag, q.x, z); });
    });
  }
};
struct Wide : Pipe<DrawWide> {};

/// Sums and the like, of which the order does not show.
struct DrawCounted : Boxes {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 q) {
      update(state().best, q, [&](Best &b) {
        b.best += p.tag % 100 + q.x;
        if (p.tag & 1)
          b.id -= unsigned(q.y);
      });
      update(state().counts, q, [&](Count &c) {
        ++c.of[1][0];
        c.most = std::max(c.most, int64_t(p.tag) * q.x);
        c.bits |= 1u << (p.tag & 31);
      });
    });
  }
};
struct Counted : Pipe<DrawCounted> {};

/// Both: a flag for all that came, and the nearest of them.
struct DrawMarked : Boxes {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 q) {
      update(state().best, q, [&](Best &b) { b.id ^= unsigned(p.tag); });
      update(state().both, q, [&](Both &b) { b.kind = 1; });
      float z = depthOf(p, q.x);
      update(state().depth, q, [z](Depth &d) { d.z = std::min(d.z, z); });
    });
  }
};
struct Marked : Pipe<DrawMarked> {};

/// Launched several times in a frame, each with what others have left.
struct Step : Boxes {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 q) {
      float z = depthOf(p, q.x);
      update(state().depth, q, [z](Depth &d) {
        if (z < d.z)
          d.z = z;
      });
    });
  }
};
struct Again : Step {
  void schedule(piko::BinId) { endStage<Step>(); }
};
struct Rounds : piko::Pipe<State> {
  Step step;
  Again again;
  Rounds() {
    source(step);
    source(again);
  }
};

struct DrawOutside : Boxes {
  void process(const Point &p) {
    float z = float(p.tag);
    for (int x = p.x; x < p.x + 2; ++x)
      update(state().depth, {x, p.y + (p.tag == 3000 ? 1000 : 0)},
             [z](Depth &d) {
               if (z < d.z)
                 d.z = z;
             });
  }
};
struct Outside : Pipe<DrawOutside> {};
