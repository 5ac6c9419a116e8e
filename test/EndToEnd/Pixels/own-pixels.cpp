// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Iterations that update pixels of their own, in the styles in which their
// numbers are made pixels, are shared by the threads of a GPU; those that may
// meet in a pixel keep their order.
// RUN: %compare_targets %s --cases %s --runs 1
// CASE: --pipe Flat --count 60 --domain 40 30
// CASE: --pipe Unsigned --count 60 --domain 40 30
// CASE: --pipe Subtracted --count 60 --domain 40 30
// CASE: --pipe Bits --count 60 --domain 40 30
// CASE: --pipe Flipped --count 60 --domain 40 30
// CASE: --pipe Tiled --count 60 --domain 40 30
// CASE: --pipe Rows --count 60 --domain 40 30
// CASE: --pipe Columns --count 60 --domain 40 30
// CASE: --pipe Twice --count 60 --domain 40 30
// CASE: --pipe Only --count 60 --domain 40 30
// CASE: --pipe Diagonal --count 60 --domain 40 30
// CASE: --pipe Transposed --count 60 --domain 40 30
// CASE: --pipe Widths --count 60 --domain 40 30
// CASE: --pipe Halves --count 60 --domain 40 30
// CASE: --pipe Mixed --count 60 --domain 40 30
// RUN: pikoc %s --pipe Flat,Unsigned,Subtracted,Bits,Flipped,Tiled,Rows,Columns,Twice,Only,Diagonal,Transposed --emit=gpu --remarks -o /dev/null 2>&1 | FileCheck %s --check-prefix=SHARED
// SHARED-NOT: one thread does
// SHARED: lanes are given
// SHARED-NOT: one thread does
#include <piko.h>

struct Item {
  int x, y;
  float value;
};
struct Cell {
  float sum = 0.25f;
  int last = -1;
};
struct State {
  piko::Image<Cell> image;
  piko::Buffer<int> table;
};

struct Body : piko::Stage<0, 0, 64, Item>, piko::Uses<State> {
  static constexpr int w = 11, h = 6;
  int left(const Item &item) const { return (item.x & 15); }
  int top(const Item &item) const { return (item.y & 15); }
  static float shade(const Item &item, int i) {
    float v = item.value;
    for (int k = 0; k < 6; ++k)
      v = v * 0.75f + float(i) * 0.125f;
    return v;
  }
  void mix(int x, int y, float value, int tag) {
    update(state().image, glm::ivec2(x, y), [&](Cell &c) {
      c.sum = c.sum * 0.75f + value;
      c.last = c.last * 3 + tag;
    });
  }
};

struct FlatBody : Body {
  void process(const Item &item) {
    parallelFor(w * h, [&](int i) {
      mix(left(item) + i % w, top(item) + i / w, shade(item, i), i);
    });
  }
};
struct UnsignedBody : Body {
  void process(const Item &item) {
    unsigned width = 3 + (item.x & 7);
    parallelFor(width * h, [&](int i) {
      unsigned x = unsigned(i) % width, y = unsigned(i) / width;
      mix(left(item) + int(x), top(item) + int(y), shade(item, i), i);
    });
  }
};
struct SubtractedBody : Body {
  void process(const Item &item) {
    int width = 3 + (item.x & 7);
    parallelFor(width * h, [&](int i) {
      int y = i / width, x = i - y * width;
      mix(left(item) + x, top(item) + y, shade(item, i), i);
    });
  }
};
struct BitsBody : Body {
  void process(const Item &item) {
    parallelFor(8 * h, [&](int i) {
      mix(left(item) + (i & 7), top(item) + (i >> 3), shade(item, i), i);
    });
  }
};
struct FlippedBody : Body {
  void process(const Item &item) {
    parallelFor(w * h, [&](int i) {
      int x = w - 1 - i % w, y = h - 1 - i / w;
      mix(left(item) + x, top(item) + y, shade(item, i), i);
    });
  }
};
// A tile of 4 x 4.
struct TiledBody : Body {
  void process(const Item &item) { parallelForCells(item); }
  void parallelForCells(const Item &item) {
    int bx = left(item), by = top(item);
    parallelFor(16, [&](int i) {
      glm::ivec2 p(bx + i % 4, by + i / 4);
      mix(p.x, p.y, shade(item, i), i);
    });
  }
};
struct RowsBody : Body {
  void process(const Item &item) {
    parallelFor(h, [&](int row) {
      for (int x = 0; x < w; ++x)
        mix(left(item) + x, top(item) + row, shade(item, x), row);
    });
  }
};
struct ColumnsBody : Body {
  void process(const Item &item) {
    parallelFor(w, [&](int column) {
      for (int y = 0; y < h; ++y)
        mix(left(item) + column, top(item) + y, shade(item, y), column);
    });
  }
};
struct TwiceBody : Body {
  void process(const Item &item) {
    parallelFor(w * h, [&](int i) {
      int x = left(item) + i % w, y = top(item) + i / w;
      mix(x, y, shade(item, i), i);
      if (i % 3 == 0)
        mix(x, y, 0.5f, 7);
    });
  }
};
struct OnlyBody : Body {
  void process(const Item &item) {
    parallelFor(20, [&](int i) {
      float v = shade(item, i);
      if (i == 7)
        mix(left(item), top(item), v, i);
    });
  }
};
struct DiagonalBody : Body {
  void process(const Item &item) {
    parallelFor(14, [&](int i) {
      mix(left(item) + i, top(item) + i, shade(item, i), i);
    });
  }
};
struct TransposedBody : Body {
  void process(const Item &item) {
    parallelFor(w * h, [&](int i) {
      mix(left(item) + i / h, top(item) + i % h, shade(item, i), i);
    });
  }
};

// The width differs from iteration to iteration: several may meet.
struct WidthsBody : Body {
  void process(const Item &item) {
    parallelFor(60, [&](int i) {
      int width = 2 + (state().table[i & 63] & 3);
      mix(i % width, i / width, shade(item, i), i);
    });
  }
};
// Half of a number is that of another one, too.
struct HalvesBody : Body {
  void process(const Item &item) {
    parallelFor(60, [&](int i) {
      mix(left(item) + i / 4, top(item), shade(item, i), i);
    });
  }
};
// A quotient and a remainder that do not belong together.
struct MixedBody : Body {
  void process(const Item &item) {
    parallelFor(60, [&](int i) {
      mix(left(item) + i % 5, top(item) + i / 7, shade(item, i), i);
    });
  }
};

#define PIPE(NAME)                                                             \
  struct NAME : piko::Pipe<State> {                                            \
    NAME##Body stage;                                                          \
    NAME() { source(stage); }                                                  \
  };
PIPE(Flat)
PIPE(Unsigned)
PIPE(Subtracted)
PIPE(Bits)
PIPE(Flipped)
PIPE(Tiled)
PIPE(Rows)
PIPE(Columns)
PIPE(Twice)
PIPE(Only)
PIPE(Diagonal)
PIPE(Transposed)
PIPE(Widths)
PIPE(Halves)
PIPE(Mixed)
