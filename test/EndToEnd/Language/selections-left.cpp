// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Where the order of updates shows, or might, one thread runs a bin that is the
// whole domain, and a remark says why.
// REQUIRES: all
// RUN: %compare_targets %s --cases %s --threads 1 2 7
// RUN: env PIKO_CUDA_DRIVER=%test_driver piko-compare %s --pipe Element --count 3000 --domain 67 35 --runs 1 --target cuda | FileCheck %s --check-prefix=GPU
// GPU: {{^equal$}}
// CASE: --pipe Blended --count 3000 --domain 67 35
// CASE: --pipe Negated --count 3000 --domain 67 35
// CASE: --pipe Other --count 3000 --domain 67 35
// CASE: --pipe Previous --count 3000 --domain 67 35
// CASE: --pipe Passing --count 3000 --domain 67 35
// CASE: --pipe Failing --count 3000 --domain 67 35
// CASE: --pipe Reading --count 3000 --domain 67 35
// CASE: --pipe Elsewhere --count 3000 --domain 67 35
// CASE: --pipe Uneven --count 3000 --domain 67 35
// CASE: --pipe Second --count 3000 --domain 67 35
// CASE: --pipe Sometimes --count 3000 --domain 67 35
// CASE: --pipe Element --count 3000 --domain 67 35
// RUN: rm -f %t.txt
// RUN: echo pipe Blended >> %t.txt; pikoc %s --pipe Blended --remarks -o %t.o 2>> %t.txt
// RUN: echo pipe Negated >> %t.txt; pikoc %s --pipe Negated --remarks -o %t.o 2>> %t.txt
// RUN: echo pipe Other >> %t.txt; pikoc %s --pipe Other --remarks -o %t.o 2>> %t.txt
// RUN: echo pipe Previous >> %t.txt; pikoc %s --pipe Previous --remarks -o %t.o 2>> %t.txt
// RUN: echo pipe Passing >> %t.txt; pikoc %s --pipe Passing --remarks -o %t.o 2>> %t.txt
// RUN: echo pipe Failing >> %t.txt; pikoc %s --pipe Failing --remarks -o %t.o 2>> %t.txt
// RUN: echo pipe Reading >> %t.txt; pikoc %s --pipe Reading --remarks -o %t.o 2>> %t.txt
// RUN: echo pipe Elsewhere >> %t.txt; pikoc %s --pipe Elsewhere --remarks -o %t.o 2>> %t.txt
// RUN: echo pipe Uneven >> %t.txt; pikoc %s --pipe Uneven --remarks -o %t.o 2>> %t.txt
// RUN: echo pipe Second >> %t.txt; pikoc %s --pipe Second --remarks -o %t.o 2>> %t.txt
// RUN: echo pipe Sometimes >> %t.txt; pikoc %s --pipe Sometimes --remarks -o %t.o 2>> %t.txt
// RUN: echo pipe Element >> %t.txt; pikoc %s --pipe Element --remarks -o %t.o 2>> %t.txt
// RUN: FileCheck %s --check-prefix=WHY --input-file %t.txt
#include "../Inputs/ports.h"

struct Depth {
  float z = 30;
};
struct Color {
  glm::vec3 rgb{0.1f};
};
struct Two {
  float z = 30, w = 30;
  float previous = 0;
};
struct Four {
  float of[4] = {1, 2, 3, 4};
};
struct State {
  piko::Image<Depth> depth;
  piko::Image<Color> color;
  piko::Image<Two> two;
  piko::Image<Four> four;
  piko::Buffer<int> hits;
  piko::Buffer<float> table;
};

inline float depthOf(const Point &p, int x) {
  return float((p.tag * 77 + x) % 23);
}

struct Boxes : piko::Stage<0, 0, 64, Point, Point>, piko::Uses<State> {
  void forBox(const Point &p, auto &&body) const {
    for (int y = std::max(p.y, 0); y < std::min(p.y + p.tag % 5, domain().y);
         ++y)
      for (int x = std::max(p.x, 0); x < std::min(p.x + p.tag % 7, domain().x);
           ++x)
        body(glm::ivec2(x, y), depthOf(p, x));
  }
};
// One call for all of them: the last one is seen.
struct Sink : piko::Stage<0, 0, 64, Point>, piko::Uses<State> {
  void process(const piko::List<Point> &points) {
    for (const Point &p : points)
      if (p.tag >= 0)
        state().hits[p.tag & 63] = p.x;
  }
};
template <class Draw> struct Pipe : piko::Pipe<State> {
  Draw draw;
  Sink sink;
  Pipe() {
    source(draw);
    connect(draw, 0, sink);
  }
};

struct DrawBlended : Boxes {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 q, float z) {
      update(state().color, q, [&](Color &c) { c.rgb = c.rgb * 0.5f + z; });
    });
  }
};
struct Blended : Pipe<DrawBlended> {};
// WHY-LABEL: pipe Blended
// WHY: remark: stage 'draw' runs its only bin on one thread
// WHY: note: the pixel becomes something that depends on what it was

struct DrawNegated : Boxes {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 q, float z) {
      update(state().depth, q, [&](Depth &d) {
        if (z >= d.z)
          return;
        d.z = z;
      });
    });
  }
};
struct Negated : Pipe<DrawNegated> {};
// WHY-LABEL: pipe Negated
// WHY: note: a NaN passes this comparison, too

struct DrawOther : Boxes {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 q, float z) {
      update(state().depth, q, [&](Depth &d) {
        if (z < d.z)
          d.z = z + 1;
      });
    });
  }
};
struct Other : Pipe<DrawOther> {};
// WHY-LABEL: pipe Other
// WHY: note: the pixel keeps something else than what is compared with it

struct DrawPrevious : Boxes {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 q, float z) {
      update(state().two, q, [&](Two &t) {
        if (z < t.z) {
          t.previous = t.z;
          t.z = z;
        }
      });
    });
  }
};
struct Previous : Pipe<DrawPrevious> {};
// WHY-LABEL: pipe Previous
// WHY: note: the pixel becomes something that depends on what it was

struct DrawPassing : Boxes {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 q, float z) {
      bool passed = false;
      update(state().depth, q, [&](Depth &d) {
        passed = z < d.z;
        if (passed)
          d.z = z;
      });
      if (passed)
        emit(Point{q.x, q.y, z, p.tag});
    });
  }
};
struct Passing : Pipe<DrawPassing> {};
// WHY-LABEL: pipe Passing
// WHY: note: this may fail, or shows, where something else is first in the end

struct DrawFailing : Boxes {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 q, float z) {
      update(state().depth, q, [&](Depth &d) {
        if (z < d.z)
          d.z = z;
      });
      update(state().two, q, [&](Two &t) {
        if (z < t.z) {
          t.z = z;
          t.w = state().table[p.tag & 63];
        }
      });
    });
  }
};
struct Failing : Pipe<DrawFailing> {};
// WHY-LABEL: pipe Failing
// WHY: note: this may fail, or shows, where something else is first in the end

struct DrawReading : Boxes {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 q, float z) {
      if (z < state().depth(q).z)
        update(state().color, q, [&](Color &c) { c.rgb = glm::vec3(z); });
      update(state().depth, q, [&](Depth &d) {
        if (z < d.z)
          d.z = z;
      });
    });
  }
};
struct Reading : Pipe<DrawReading> {};
// WHY-LABEL: pipe Reading
// WHY: note: this uses an image that is updated, too

struct DrawElsewhere : Boxes {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 q, float z) {
      bool passed = false;
      update(state().depth, q, [&](Depth &d) {
        passed = z < d.z;
        if (passed)
          d.z = z;
      });
      if (passed)
        update(state().color, {q.x / 2, q.y},
               [&](Color &c) { c.rgb = glm::vec3(z); });
    });
  }
};
struct Elsewhere : Pipe<DrawElsewhere> {};
// WHY-LABEL: pipe Elsewhere
// WHY: note: this may be another pixel than the one tested

struct DrawUneven : Boxes {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 q, float z) {
      update(state().two, q, [&](Two &t) {
        if (p.tag & 1) {
          if (z < t.z)
            t.z = z;
        } else if (z < t.w) {
          t.w = z;
        }
      });
    });
  }
};
struct Uneven : Pipe<DrawUneven> {};
// WHY-LABEL: pipe Uneven
// WHY: note: the pixel becomes something that depends on what it was

struct DrawSecond : Boxes {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 q, float z) {
      float w =
          p.tag % 11 == 0 ? 0.0f / float(p.tag - p.tag) : float(p.tag % 5);
      update(state().two, q, [&](Two &t) {
        if (z < t.z || (z == t.z && w < t.w)) {
          t.z = z;
          t.w = w;
        }
      });
    });
  }
};
struct Second : Pipe<DrawSecond> {};
// WHY-LABEL: pipe Second
// WHY: note: a number after the first of a key may be a NaN

struct DrawSometimes : Boxes {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 q, float z) {
      bool passed = false;
      update(state().depth, q, [&](Depth &d) {
        passed = z < d.z;
        if (passed)
          d.z = z;
      });
      if (passed && p.tag % 3 == 0)
        update(state().color, q, [&](Color &c) { c.rgb = glm::vec3(z); });
    });
  }
};
struct Sometimes : Pipe<DrawSometimes> {};
// WHY-LABEL: pipe Sometimes
// WHY: note: {{whether this pixel changes depends on more than on the first test|this depends on what was first so far}}

// An element that is chosen when it runs: the others stay what they were.
struct DrawElement : Boxes {
  void process(const Point &p) {
    forBox(p, [&](glm::ivec2 q, float z) {
      update(state().four, q, [&](Four &four) { four.of[p.tag & 3] = z; });
    });
  }
};
struct Element : Pipe<DrawElement> {};
// WHY-LABEL: pipe Element
// WHY: note: the pixel becomes something that depends on what it was
