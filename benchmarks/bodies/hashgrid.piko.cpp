// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Features of a point from a hash table with linear probing, in the eight
// corners of its cell.
#include <piko.h>

struct Sample {
  glm::vec3 at;
  int index;
};
struct Entry {
  int x, y, z;
  float value;
};
struct State {
  piko::Buffer<Entry> table;
  piko::Buffer<float> out;
};

struct LookUp : piko::Stage<0, 0, 1, Sample>, piko::Uses<State> {
  float find(int x, int y, int z) const {
    uint32_t size = uint32_t(state().table.size());
    uint32_t slot = (uint32_t(x) * 73856093u ^ uint32_t(y) * 19349663u ^
                     uint32_t(z) * 83492791u) %
                    size;
    for (int probe = 0; probe < 16; ++probe) {
      const Entry &e = state().table[slot];
      if (e.x == x && e.y == y && e.z == z)
        return e.value;
      if (e.x < 0)
        return 0;
      slot = (slot + 1) % size;
    }
    return 0;
  }
  void process(const Sample &s) {
    glm::vec3 cell = glm::floor(s.at);
    glm::vec3 t = s.at - cell;
    glm::ivec3 base(cell);
    float sum = 0;
    for (int i = 0; i < 8; ++i) {
      int dx = i & 1, dy = i >> 1 & 1, dz = i >> 2;
      float weight =
          (dx ? t.x : 1 - t.x) * (dy ? t.y : 1 - t.y) * (dz ? t.z : 1 - t.z);
      sum += weight * find(base.x + dx, base.y + dy, base.z + dz);
    }
    state().out[s.index] = sum;
  }
};
struct HashGrid : piko::Pipe<State> {
  LookUp lookUp;
  HashGrid() { source(lookUp); }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  std::vector<Sample> samples;
  std::vector<Entry> table = std::vector<Entry>(8191, {-1, 0, 0, 0});
  std::vector<float> out;
  void bind(auto &pipe) {
    bodies::Random random;
    for (int i = 0; i < 4000; ++i) {
      int x = int(random.below(16)), y = int(random.below(16)),
          z = int(random.below(16));
      uint32_t slot = (uint32_t(x) * 73856093u ^ uint32_t(y) * 19349663u ^
                       uint32_t(z) * 83492791u) %
                      8191;
      while (table[slot].x >= 0)
        slot = (slot + 1) % 8191;
      table[slot] = {x, y, z, random.unit()};
    }
    for (int i = 0; i < 40000; ++i)
      samples.push_back(
          {{random.in(0, 15), random.in(0, 15), random.in(0, 15)}, i});
    out.resize(samples.size());
    pipe.setDomain({1, 1});
    bodies::bind(pipe.state().table, table);
    bodies::bind(pipe.state().out, out);
    pipe.feed(pipe.lookUp, samples);
  }
  uint64_t result(auto &) { return bodies::hash(out); }
};
PIKO_BODY_MAIN(HashGrid, Host)
#endif
