// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Iterations that run as lanes of vectors give the reference executor's numbers,
// in every style of body: loops that end at different times, arrays of an
// iteration, integers of all sizes, divisors that are 0 elsewhere.
// REQUIRES: all
// RUN: %compare_targets %s --cases %s --runs 1
// CASE: --pipe Escapes --domain 67 35 --count 320
// CASE: --pipe Sorts --domain 67 35 --count 320
// CASE: --pipe Searches --domain 67 35 --count 320
// CASE: --pipe Bytes --domain 67 35 --count 320
// CASE: --pipe Divides --domain 67 35 --count 320
// CASE: --pipe Doubles --domain 67 35 --count 320
// CASE: --pipe Wraps --domain 67 35 --count 320
// CASE: --pipe Counts --domain 67 35 --count 320
// RUN: piko-compare %s --cases %s --runs 1 --without vectorize -O0
//
// RUN: pikoc %s --pipe Escapes --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=VECTORS
// RUN: pikoc %s --pipe Sorts --remarks -O0 -o /dev/null 2>&1 | FileCheck %s --check-prefix=VECTORS
// VECTORS: .cpp:[[#]]:{{[0-9]+}}: remark: stage '{{.*}}': these iterations are vectorized for {{4|8}} at once
#include "../Inputs/vector-iterations.h"

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

// Loops that end after different numbers of iterations, and in the middle.
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

// A sum that wraps, and goes on in more bits.
struct Wrap {
  static void run(State &state, const Item &p, int i, int at) {
    int near = 2147483647 - 5;
    int64_t place = int64_t(i + near) + 2147483648ll + p.serial;
    float value = p.value * float(i);
    for (int k = 0; k < 3; ++k)
      value = value * value * 0.25f + 1;
    if (place >= 0 && place < int64_t(state.floats.size()))
      state.floats[place] = value;
    state.ints[at] = int(place);
  }
};
struct Wraps : Alone<Works<Wrap>> {};

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
