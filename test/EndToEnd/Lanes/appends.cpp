// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loops that append to lists, said in many ways: the elements of the reference
// executor, in its order, where lanes append by stream compaction and where
// something is in the way.
// RUN: %compare_targets %s --cases %s --runs 1 --threads 2
// CASE: --pipe PPlain --elements 1000
// CASE: --pipe PWhile --elements 1000
// CASE: --pipe PStack --elements 1000
// CASE: --pipe PLimited --elements 1000
// CASE: --pipe PLimitedFirst --elements 1000
// CASE: --pipe PLimitOfState --elements 1000
// CASE: --pipe PContinue --elements 1000
// CASE: --pipe PTwo --elements 1000
// CASE: --pipe PRecord --elements 1000
// CASE: --pipe PCount --elements 1000
// CASE: --pipe PNested --elements 1000
// CASE: --pipe PFilled --elements 1000
// CASE: --pipe PTwice --elements 1000
// CASE: --pipe PChunks --elements 1000
// CASE: --pipe PUnsigned --elements 1000
// CASE: --pipe PFlags --elements 1000
// CASE: --pipe PBytes --elements 1000
// CASE: --pipe PScan --elements 1000
// CASE: --pipe PBranchless --elements 1000
// CASE: --pipe PBreak --elements 1000
// CASE: --pipe PDown --elements 1000
// CASE: --pipe PReads --elements 1000
// CASE: --pipe PPlaces --elements 1000
// CASE: --pipe PDepends --elements 1000
// CASE: --pipe PFull --elements 1000
// CASE: --pipe PSaturated --elements 1000
// CASE: --pipe PInVain --elements 1000
// CASE: --pipe PLoopsInVain --elements 1000
// CASE: --pipe PDividesInVain --elements 1000
// CASE: --pipe PCompacted --elements 1000
// The first that is outside is another in other lanes, or none of the list:
// RUN: not piko-compare %s --pipe POutside --elements 1000 --runs 1 --threads 2 | FileCheck %s --check-prefix=OUTSIDE
// OUTSIDE: got: stage 's', bin 0: expected an index into 'x' in [0, 1000), but got 1000
//
// RUN: pikoc %s --pipe PPlain,PWhile,PStack,PLimited,PLimitedFirst,PLimitOfState,PContinue,PTwo,PRecord,PCount,PNested,PFilled,PTwice,PChunks,PUnsigned,PFlags,PBytes --cpu x86-64-v3 --remarks --emit=target -o /dev/null 2>&1 | FileCheck %s
// CHECK-NOT:      one element after the other
// CHECK-COUNT-34: iterations of this loop append in order, by stream compaction, and are vectorized for 8 at once
// CHECK-NOT:      one element after the other
// RUN: pikoc %s --pipe PBranchless,PBreak,PDown,PReads,PPlaces,PDepends --cpu x86-64-v3 --remarks --emit=target -o /dev/null 2>&1 | FileCheck %s --check-prefix=REFUSED
// REFUSED-NOT: by stream compaction
// REFUSED:     this loop appends one element after the other
// REFUSED:     note: here a list, or its length, is used for something else
// REFUSED-NOT: by stream compaction
#include <piko.h>

struct Item {
  int k;
};

struct State {
  piko::Buffer<float> x, y;
  piko::Buffer<uint8_t> tag;
  piko::Buffer<int> out;
  float limit;
  int most;
};

constexpr int size = 1000;

template <class Self>
struct Lists : piko::BasicStage<piko::Bins<16, 16>, 64, Item>,
               piko::Uses<State> {
  void assignBin(const Item &item) { this->assignToAll(item); }
  bool isIn(int i) const {
    float x = this->state().x[i], y = this->state().y[i];
    return x * x + y * y < this->state().limit * 8.0f + 40.0f;
  }
  /// Hashes a list, and another number, into pixels of the bin.
  template <class List> void use(const List &list, int n, int more = 0) {
    this->parallelForPixels([&](glm::ivec2 at) {
      int sum = more;
      for (int k = 0; k < n; ++k)
        sum = sum * 31 + int(list[k]) * (at.x + 1);
      int place =
          (at.y * this->domain().x + at.x) % int(this->state().out.size());
      if (at.y * this->domain().x + at.x < int(this->state().out.size()))
        this->state().out[place] = sum;
    });
  }
};

#define LISTS(Name)                                                            \
  struct Name : Lists<Name> {                                                  \
    void process(const piko::List<Item> &);                                    \
  };                                                                           \
  struct P##Name : piko::Pipe<State> {                                         \
    Name s;                                                                    \
    P##Name() { source(s); }                                                   \
  };                                                                           \
  inline void Name::process([[maybe_unused]] const piko::List<Item> &items)

LISTS(Plain) {
  int list[size], n = 0;
  for (int i = 0; i < size; ++i)
    if (isIn(i))
      list[n++] = i;
  use(list, n);
}
LISTS(While) {
  int list[size], i = 0, n = 0;
  while (i < size) {
    if (isIn(i)) {
      list[n] = i * 2;
      n += 1;
    }
    i++;
  }
  use(list, n, i);
}
LISTS(Stack) {
  struct Numbers {
    int n = 0;
    float data[size];
    void push_back(float v) { data[n++] = v; }
    int length() const { return n; }
  } numbers;
  for (int i = 0; i < size; ++i)
    if (isIn(i))
      numbers.push_back(state().x[i] * 100);
  use(numbers.data, numbers.length());
}
LISTS(Limited) {
  int list[64], n = 0;
  for (int i = 0; i < size; ++i)
    if (isIn(i) && n < 64)
      list[n++] = i;
  use(list, n);
}
LISTS(LimitedFirst) {
  int list[64];
  unsigned n = 0;
  for (int i = 0; i < size; ++i)
    if (n < 64u && isIn(i))
      list[n++] = i;
  use(list, int(n));
}
LISTS(LimitOfState) {
  int list[size], n = 5;
  for (int k = 0; k < n; ++k)
    list[k] = -k;
  for (int i = 0; i < size; ++i)
    if (isIn(i))
      if (n < state().most)
        list[n++] = i;
  use(list, n);
}
LISTS(Continue) {
  int list[64], n = 0;
  for (int i = 0; i < size; ++i) {
    if (n >= 64)
      continue;
    if (!isIn(i))
      continue;
    list[n++] = i;
  }
  use(list, n);
}
LISTS(Two) {
  int a[size], b[size], na = 0, nb = 0;
  for (int i = 0; i < size; ++i)
    if (isIn(i))
      a[na++] = i;
    else
      b[nb++] = i;
  use(a, na, nb > 0 ? b[nb - 1] : nb);
}
LISTS(Record) {
  struct Hit {
    float d;
    int i;
    uint8_t tag;
    double w;
  };
  Hit hits[size];
  int n = 0;
  for (int i = 0; i < size; ++i) {
    float d = state().x[i] * 3 - state().y[i];
    if (d > 0.5f)
      hits[n++] = Hit{d, i, state().tag[i], double(d) * 0.1};
  }
  int sum = 0;
  for (int i = 0; i < n; ++i)
    sum = sum * 7 + hits[i].i + int(hits[i].d * 8) + hits[i].tag +
          int(hits[i].w * 64);
  const int none[1] = {};
  use(none, 0, sum);
}
LISTS(Count) {
  int n = 0, m = 0;
  for (int i = 0; i < size; ++i) {
    n += isIn(i);
    if (state().y[i] > 0.3f)
      ++m;
  }
  const int none[1] = {};
  use(none, 0, n * 1024 + m);
}
LISTS(Nested) {
  int list[size], n = 0;
  for (int i = 0; i < size; ++i)
    if (state().x[i] > 0.125f) {
      float y = state().y[i];
      if (y < 6.5f)
        if (y * state().x[i] < state().limit)
          list[n++] = i + 1;
    }
  use(list, n);
}
LISTS(Filled) {
  int list[size], n = 0;
  for (int i = 0; i < size; ++i)
    list[i] = -i;
  for (int i = 0; i < size; ++i)
    if (isIn(i))
      list[n++] = i;
  use(list, size, n);
}
LISTS(Twice) {
  int list[2 * size], n = 0;
  for (int i = 0; i < size; ++i)
    if (isIn(i))
      list[n++] = i;
  for (int i = 0; i < size; ++i)
    if (!isIn(i))
      list[n++] = -i;
  use(list, n);
}
LISTS(Chunks) {
  int list[size / 4] = {}, sum = 0;
  for (int chunk = 0; chunk < 4; ++chunk) {
    int n = 0;
    for (int i = chunk * (size / 4); i < (chunk + 1) * (size / 4); ++i)
      if (isIn(i))
        list[n++] = i;
    // What the chunk before left after the end is still there.
    for (int k = 0; k < size / 8; ++k)
      sum = sum * 7 + list[k];
  }
  const int none[1] = {};
  use(none, 0, sum);
}
LISTS(Unsigned) {
  int64_t list[size];
  size_t n = 0;
  for (size_t i = 0; i < size_t(size); ++i)
    if (isIn(int(i)))
      list[n++] = int64_t(i) << 20;
  int sum = 0;
  for (size_t k = 0; k < n; ++k)
    sum = sum * 31 + int(list[k] >> 20);
  const int none[1] = {};
  use(none, 0, sum);
}
LISTS(Flags) {
  bool flags[size];
  int list[size], n = 0;
  parallelFor(size, [&](int i) { flags[i] = isIn(i); });
  for (int i = 0; i < size; ++i)
    if (flags[i])
      list[n++] = i;
  use(list, n);
}
LISTS(Bytes) {
  uint8_t low[size];
  uint16_t high[size];
  int n = 0;
  for (int i = 0; i < size; ++i)
    if (isIn(i)) {
      low[n] = uint8_t(i);
      high[n] = uint16_t(i * 3);
      ++n;
    }
  int sum = 0;
  for (int i = 0; i < n; ++i)
    sum = sum * 31 + low[i] * high[i];
  const int none[1] = {};
  use(none, 0, sum);
}
LISTS(Scan) {
  int list[size], last[1];
  parallelFor(size, [&](int i) {
    bool in = isIn(i);
    int place = scan(int(in), [](int a, int b) { return a + b; });
    if (in)
      list[place] = i;
    if (i == size - 1)
      last[0] = place + in;
  });
  use(list, last[0]);
}

// What is done where a list is full must not show, as it is not done.
LISTS(Full) {
  int list[size], other[64] = {}, more[64], n = 0;
  for (int i = 0; i < size; ++i)
    if (isIn(i))
      list[n++] = i;
  int known = n;
  for (int i = 0; i < size; ++i)
    if (!isIn(i) && n < 64)
      other[n++] = i;
  for (int i = 0; i < size; ++i)
    if (!isIn(i + 1 < size ? i + 1 : 0) && n < 64)
      more[n++] = i;
  use(list, known, n * 64 + other[63]);
}
LISTS(Saturated) {
  unsigned n = 0xffffff00u;
  for (int i = 0; i < size; ++i)
    if (isIn(i) && n < 0xfffffffeu)
      ++n;
  const int none[1] = {};
  use(none, 0, int(n));
}
LISTS(InVain) {
  int few[64], list[64], n = 0;
  for (int k = 0; k < 64; ++k)
    few[k] = k * 3;
  for (int i = 0; i < size; ++i)
    if (n < 64)
      list[n++] = few[i] + i;
  use(list, n);
}
LISTS(LoopsInVain) {
  int list[64], n = 0;
  for (int i = 0; i < size; ++i)
    if (n < 64) {
      int steps = 0; // None ends from 0.
      for (int x = i < 64 ? i + 1 : 0; x != 1; x = x & 1 ? 3 * x + 1 : x / 2)
        ++steps;
      list[n++] = steps;
    }
  use(list, n);
}
LISTS(DividesInVain) {
  int list[64], n = 0;
  for (int i = 0; i < size; ++i)
    if (n < 64)
      list[n++] = 1000 / (i < 64 ? i + 1 : 0);
  use(list, n);
}
LISTS(Compacted) {
  int list[size], n = 0;
  for (int i = 0; i < size; ++i)
    if (isIn(i)) {
      int steps = 0;
      for (int x = i + 1; x != 1; x = x & 1 ? 3 * x + 1 : x / 2)
        ++steps;
      list[n++] = steps;
    }
  use(list, n);
}

LISTS(Branchless) {
  int list[size + 1], n = 0;
  for (int i = 0; i < size; ++i) {
    list[n] = i;
    n += isIn(i) ? 1 : 0;
  }
  use(list, n);
}
LISTS(Break) {
  int list[64], n = 0;
  for (int i = 0; i < size; ++i) {
    if (isIn(i))
      list[n++] = i;
    if (n == 64)
      break;
  }
  use(list, n);
}
LISTS(Down) {
  int list[size], n = 0;
  auto push = [&](int v) { list[n++] = v; };
  for (int i = size - 1; i >= 0; --i)
    if (isIn(i))
      push(i);
  use(list, n);
}
LISTS(Reads) {
  int list[size + 1], n = 1;
  list[0] = 3;
  for (int i = 0; i < size; ++i)
    if (isIn(i)) {
      list[n] = list[n - 1] + i;
      ++n;
    }
  use(list, n);
}
LISTS(Places) {
  int list[size], n = 0, sum = 0;
  for (int i = 0; i < size; ++i) {
    if (isIn(i))
      list[n++] = i;
    sum = sum * 3 + n;
  }
  use(list, n, sum);
}
LISTS(Depends) {
  int a[size], b[size], na = 0, nb = 0;
  for (int i = 0; i < size; ++i)
    if (isIn(i)) {
      if (na < 32)
        a[na++] = i;
      else
        b[nb++] = i;
    }
  use(a, na, nb > 0 ? b[nb - 1] : 0);
}
LISTS(Outside) {
  int list[64], n = 0;
  for (int i = 0; i < size + 8; ++i)
    if (isIn(i) && n < 64)
      list[n++] = i;
  use(list, n);
}
