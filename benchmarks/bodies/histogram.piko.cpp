// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Histograms of tiles of a picture, in a private array first.
#include <piko.h>

struct Tile {
  int x, y, index;
};
struct State {
  int width = 0;
  piko::Buffer<uint8_t> pixels;
  piko::Buffer<int> tiles, all;
};

struct Count : piko::Stage<0, 0, 1, Tile>, piko::Uses<State> {
  void process(const Tile &tile) {
    int counts[64] = {};
    for (int y = tile.y; y < tile.y + 32; ++y)
      for (int x = tile.x; x < tile.x + 32; ++x)
        ++counts[state().pixels[y * state().width + x] >> 2];
    for (int i = 0; i < 64; ++i) {
      state().tiles[tile.index * 64 + i] = counts[i];
      if (counts[i])
        piko::atomicAdd(state().all[i], counts[i]);
    }
  }
};
struct Histogram : piko::Pipe<State> {
  Count count;
  Histogram() { source(count); }
};

#ifdef PIKO_BODY
#include "host.h"
struct Host {
  int w = 1024, h = 1024;
  std::vector<Tile> list;
  std::vector<uint8_t> pixels;
  std::vector<int> tiles = std::vector<int>(1024 * 64),
                   all = std::vector<int>(64);
  void bind(auto &pipe) {
    bodies::Random random;
    for (int i = 0; i < w * h; ++i)
      pixels.push_back(uint8_t((random.next() & random.next()) >> 3));
    for (int i = 0; i < 1024; ++i)
      list.push_back({i % 32 * 32, i / 32 * 32, i});
    pipe.setDomain({1, 1});
    pipe.state().width = w;
    bodies::bind(pipe.state().pixels, pixels);
    bodies::bind(pipe.state().tiles, tiles);
    bodies::bind(pipe.state().all, all);
    pipe.feed(pipe.count, list);
  }
  uint64_t result(auto &) { return bodies::hash(tiles) ^ bodies::hash(all); }
};
PIKO_BODY_MAIN(Histogram, Host)
#endif
