// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loops that lanes share though they are written in order, short arrays of each
// lane, remainders by what lanes share, and reads of records under conditions.
// REQUIRES: all
// RUN: %compare_targets %s --cases %s --runs 1
// CASE: --pipe Neighbours --domain 40 40 --count 700
// CASE: --pipe Neighbours --domain 33 33 --count 5000
// CASE: --pipe Insertion --domain 8 8 --count 1003
// CASE: --pipe Lookups --domain 8 8 --count 1003 --wide
// CASE: --pipe Remainders --domain 8 8 --count 1003 --wide
// CASE: --pipe Bytes --domain 8 8 --count 1003
// CASE: --pipe Copies --domain 8 8 --count 300
// CASE: --pipe Late --domain 8 8 --count 300
//
// RUN: pikoc %s --pipe Neighbours --remarks -o %t.ll 2>&1 | FileCheck %s --check-prefix=REMARK
// REMARK: lane-loops.cpp:[[# @LINE + 24]]:{{.*}} iterations of this loop do not depend on one another, and are vectorized for {{.*}} at once, of those that have something to do
#include <piko.h>

#include <cstdint>

struct Prim {
  int x, y, z, w, serial;
};
struct Result {
  float sum;
  int count;
};
struct State {
  piko::Buffer<Result> results;
  piko::Buffer<Prim> prims;
  piko::Buffer<uint8_t> bytes;
  int size = 61;
};

struct Interact : piko::Stage<8, 8, 64, Prim>, piko::Uses<State> {
  void assignBin(const Prim &p) {
    assignToBin(p, binFromPosition(glm::vec2(p.x & 31, p.y & 31)));
  }
  void process(const piko::List<Prim> &list) {
    for (const Prim &a : list) {
      if ((a.z & 7) != (bin().index & 7))
        continue;
      Result result{0, 0};
      for (const Prim &b : list) {
        float d = float(b.w & 255) - float(a.w & 255);
        if (d * d > 9000)
          continue;
        result.sum += piko::sqrt(d * d) * 0.37f;
        if (a.serial != b.serial)
          ++result.count;
      }
      state().results[a.serial] = result;
    }
  }
};
struct Neighbours : piko::Pipe<State> {
  Interact interact;
  Neighbours() {
    source(interact);
    allocateForSource(state().results, 0);
  }
};

struct Insert : piko::Stage<0, 0, 1, Prim>, piko::Uses<State> {
  void process(const Prim &p) {
    uint8_t values[9];
    int keys[9];
    int n = 0;
    uint32_t seed = uint32_t(p.x);
    for (int i = 0; i < 9; ++i) {
      seed = seed * 1664525u + 1013904223u;
      if ((seed >> 30) == 0)
        continue;
      uint8_t v = uint8_t(seed >> 17);
      int at = n++;
      for (; at > 0 && values[at - 1] > v; --at) {
        values[at] = values[at - 1];
        keys[at] = keys[at - 1];
      }
      values[at] = v;
      keys[at] = i;
    }
    int hash = n;
    for (int i = 0; i < n; ++i)
      hash = hash * 31 + values[i] * 7 + keys[i];
    int turns = 0;
    for (int i = 0; i < (p.y & 7); ++i)
      turns += keys[i % (n + 1) % 9 < n ? i % (n + 1) % 9 : 0] & n;
    state().results[p.serial] = {float(n ? values[n / 2] : 0), hash + turns};
  }
};
struct Insertion : piko::Pipe<State> {
  Insert insert;
  Insertion() {
    source(insert);
    allocateForSource(state().results, 0);
  }
};

struct LookUp : piko::Stage<0, 0, 1, Prim>, piko::Uses<State> {
  void process(const Prim &p) {
    uint32_t size = uint32_t(state().prims.size());
    uint32_t slot = (uint32_t(p.x) * 73856093u ^ uint32_t(p.y)) % size;
    float found = -1;
    int probe = 0;
    for (; probe < 12; ++probe) {
      const Prim &e = state().prims[slot];
      if (e.x == (p.x & 1) && e.y == 0 && e.z == 0) {
        found = float(e.w);
        break;
      }
      if ((p.z >> probe & 3) == 3)
        break;
      slot = (slot + 1) % size;
    }
    state().results[p.serial] = {found, probe * 1000 + int(slot)};
  }
};
struct Lookups : piko::Pipe<State> {
  LookUp lookUp;
  Lookups() {
    source(lookUp);
    allocateForSource(state().results, 0);
    allocateForSource(state().prims, 0);
  }
};

struct Divide : piko::Stage<0, 0, 1, Prim>, piko::Uses<State> {
  void process(const Prim &p) {
    int n = state().size, m = (p.y & 1023) + 1;
    uint32_t u = uint32_t(p.x), big = uint32_t(n) + 4000000000u;
    int hash = p.x % n;
    hash = hash * 31 + p.x / n;
    hash = hash * 31 + p.z % -n;
    hash = hash * 31 + p.z / m + p.w % m;
    hash = hash * 31 + int(u % uint32_t(n)) + int(u / uint32_t(n));
    hash = hash * 31 + int(u % big) + int(u / big);
    hash = hash * 31 + int(u % uint32_t(m)) + int(~u / uint32_t(m));
    state().results[p.serial] = {piko::sqrt(float(m)), hash};
  }
};
struct Remainders : piko::Pipe<State> {
  Divide divide;
  Remainders() {
    source(divide);
    allocateForSource(state().results, 0);
  }
};

struct Scan : piko::Stage<0, 0, 1, Prim>, piko::Uses<State> {
  void process(const Prim &p) {
    int n = int(state().bytes.size());
    int sum = 0;
    for (int i = 0; i < 24; ++i) {
      int at = ((p.x >> 3 & 1023) * 7 + i * (p.y & 15)) % n;
      sum = sum * 3 + state().bytes[at] + i;
    }
    state().results[p.serial] = {float(sum), sum};
  }
};
struct Bytes : piko::Pipe<State> {
  Scan scan;
  Bytes() {
    source(scan);
    allocateForSource(state().results, 0);
    allocateForSource(state().bytes, 0);
  }
};

// Iterations of which several store to one place: the last one counts.
struct Copy : piko::Stage<0, 0, 1, Prim>, piko::Uses<State> {
  void process(const Prim &p) {
    int n = int(state().results.size());
    if (p.serial != 0)
      return;
    for (int i = 0; i < n; ++i) {
      float f = piko::sqrt(float(i) * 1.5f) / (float(i & 7) + 0.5f);
      state().results[i / 3] = {f, i};
    }
  }
};
struct Copies : piko::Pipe<State> {
  Copy copy;
  Copies() {
    source(copy);
    allocateForSource(state().results, 0);
  }
};

// Steps of several iterations would leave 64 bits.
struct Ending : piko::Stage<0, 0, 64, Prim>, piko::Uses<State> {
  void process(const piko::List<Prim> &list) {
    for (int64_t i = INT64_MAX - 20; i < INT64_MAX - (list[0].x & 1); ++i) {
      float sum = float(i & 31);
      for (int k = 0; k < 9; ++k)
        sum = piko::sqrt(sum * sum + 1) * 0.7f + float(k) / (sum + 3);
      state().results[int(i & 63)].sum = sum;
    }
  }
};
struct Late : piko::Pipe<State> {
  Ending ending;
  Late() {
    source(ending);
    allocateForSource(state().results, 0);
  }
};
