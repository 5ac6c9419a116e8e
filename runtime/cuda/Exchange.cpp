// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Exchange.cpp - What host and device say to each other in a frame ---===//

#include "cuda/Exchange.h"

#include <cstring>

using namespace piko::cuda;
using piko::rt::OutOfMemory;

Exchange::~Exchange() {
  for (const Chunk &chunk : chunks_) {
    device_.unmap(chunk.host);
    device_.release(chunk.device);
  }
}

void Exchange::reset() {
  for (Chunk &chunk : chunks_)
    chunk.used = 0;
  chunk_ = 0;
}

void Exchange::addChunk(size_t bytes) {
  OutOfMemory refused{static_cast<int64_t>(bytes)};
  uint8_t *host = device_.map(bytes);
  if (!host)
    throw refused;
  uint8_t *device = device_.allocate(bytes);
  if (!device) {
    device_.unmap(host);
    throw refused;
  }
  chunks_.push_back({host, device, bytes, 0});
}

uint8_t *Exchange::takeBytes(size_t bytes) {
  constexpr size_t together = size_t(128) << 10, align = 64;
  bytes = (bytes + align - 1) / align * align;
  while (chunk_ < chunks_.size() &&
         bytes > chunks_[chunk_].size - chunks_[chunk_].used)
    ++chunk_;
  if (chunk_ == chunks_.size())
    addChunk(std::max(together, bytes));
  Chunk &chunk = chunks_[chunk_];
  uint8_t *taken = chunk.host + chunk.used;
  chunk.used += bytes;
  std::memset(taken, 0, bytes);
  return taken;
}
