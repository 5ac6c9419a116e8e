// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Tiles.cpp - Copies of a bin's pixels -------------------------------===//
//
// Where the pitch of an image is a multiple of a large power of two, as that of
// 1024 pixels of 8 bytes, the rows of a bin are in few sets of the first level
// of the cache, and evict one another (conflict misses). A copy has them one
// after the other, in all sets; and what is copied is asked for at once, while
// a kernel asks for a row when it comes to it.
//
//===----------------------------------------------------------------------===//

#include "cpu/Kernel.h"

#include <algorithm>
#include <cstring>
#include <numeric>

using namespace piko::rt;

/// Of the first level: bytes that have a set each, and the lines of a set.
static constexpr int64_t setBytes = 4096, ways = 8;
/// Larger copies would not stay there.
static constexpr int64_t mostTileBytes = 48 << 10;
/// For each primitive so many bytes may be copied, and as many back.
static constexpr int64_t bytesEach = 1024;

/// Whether the rows of a bin are in some of the sets alone, and too many of
/// them.
static bool compete(int64_t rows, int64_t rowBytes, int64_t pitch) {
  int64_t places = setBytes / std::gcd(pitch, setBytes);
  return places * rowBytes < setBytes && rows > ways * places;
}

/// The lane's tile of an image, or null.
static PixelTile *findTile(Lane &lane, int32_t image) {
  for (PixelTile &tile : lane.tiles)
    if (tile.image == image)
      return &tile;
  return nullptr;
}

/// Room for `bytes`; null if memory is refused.
static PixelTile *makeTile(Lane &lane, int32_t image, int64_t bytes) {
  try {
    PixelTile *tile = findTile(lane, image);
    if (!tile) {
      tile = &lane.tiles.emplace_back();
      tile->image = image;
    }
    if (tile->memory.size() < bytes)
      tile->memory = Array<uint8_t>(lane.pipeline->memory, bytes, Use::State);
    return tile;
  } catch (...) {
    return nullptr;
  }
}

static void copyRows(uint8_t *to, int64_t toPitch, const uint8_t *from,
                     int64_t fromPitch, int64_t rows, int64_t bytes) {
  for (int64_t y = 0; y < rows; ++y)
    std::memcpy(to + y * toPitch, from + y * fromPitch,
                static_cast<size_t>(bytes));
}

extern "C" {

int64_t pikoir_tile_least(pikort_pipeline *p, int32_t stage, int32_t image) {
  const auto &bin = p->stages[stage].binSize;
  const State &state = p->states[image];
  int64_t size = p->records[state.record].size;
  if (p->rank != 2 || bin[0] <= 0 || bin[1] <= 0 || checkerOf(*p))
    return INT64_MAX;
  int64_t rows = std::min(bin[1], p->domain[1]),
          bytes = std::min(bin[0], p->domain[0]) * size;
  if (rows * bytes > mostTileBytes ||
      !compete(rows, bytes, p->domain[0] * size))
    return INT64_MAX;
  return rows * bytes / bytesEach;
}

const pikoir_tile *pikoir_open_tile(pikoir_writer *writer, int32_t image,
                                    int64_t bin) {
  Lane &lane = *static_cast<Lane *>(writer);
  const pikort_pipeline &p = *lane.pipeline;
  const Stage &stage = p.stages[lane.kernel->stage];
  const State &state = p.states[image];
  int64_t size = p.records[state.record].size;
  int64_t x = bin % stage.grid[0] * stage.binSize[0],
          y = bin / stage.grid[0] * stage.binSize[1];
  int64_t width = std::min(stage.binSize[0], p.domain[0]),
          rows = std::min(stage.binSize[1], p.domain[1] - y);
  PixelTile *tile = makeTile(lane, image, width * rows * size);
  if (!tile) {
    lane.untiled = {state.view.data, p.domain[0]};
    return &lane.untiled;
  }
  tile->rows = rows;
  tile->bytes = std::min(width, p.domain[0] - x) * size;
  tile->first = (y * p.domain[0] + x) * size;
  tile->pitch = width;
  tile->isOpen = true;
  copyRows(tile->memory.data(), tile->pitch * size,
           state.view.data + tile->first, p.domain[0] * size, tile->rows,
           tile->bytes);
  tile->data = tile->memory.data() - (y * tile->pitch + x) * size;
  return tile;
}

void pikoir_close_tile(pikoir_writer *writer, int32_t image) {
  Lane &lane = *static_cast<Lane *>(writer);
  const pikort_pipeline &p = *lane.pipeline;
  PixelTile *tile = findTile(lane, image);
  if (!tile || !tile->isOpen)
    return;
  tile->isOpen = false;
  const State &state = p.states[image];
  int64_t size = p.records[state.record].size;
  copyRows(state.view.data + tile->first, p.domain[0] * size,
           tile->memory.data(), tile->pitch * size, tile->rows, tile->bytes);
}

} // extern "C"
