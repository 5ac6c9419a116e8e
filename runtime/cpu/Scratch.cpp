// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Scratch.cpp - Memory of a call of Process --------------------------===//

#include "cpu/Kernel.h"

#include <algorithm>

using namespace piko::rt;

static constexpr int64_t alignment = 64; // of blocks, and so of offsets in them
static constexpr int64_t firstScratch = int64_t(64) << 10;

/// Goes on in a block with room for `bytes`.
static void nextBlock(Lane &lane, int64_t bytes) {
  ScratchStack &stack = lane.scratch;
  size_t next = stack.block + (stack.blocks.empty() ? 0 : 1);
  if (next == stack.blocks.size() || stack.blocks[next].capacity() < bytes) {
    int64_t last = next > 0 ? stack.blocks[next - 1].capacity() : 0;
    stack.blocks.resize(next); // those above are too small as well
    stack.blocks.emplace_back(lane.pipeline->memory,
                              std::max({bytes, 2 * last, firstScratch}));
  }
  if (next > 0)
    stack.below += stack.blocks[next - 1].capacity();
  stack.block = next;
  stack.used = 0;
}

extern "C" {

void *pikoir_scratch(pikoir_writer *writer, int64_t bytes) {
  Lane &lane = *static_cast<Lane *>(writer);
  ScratchStack &stack = lane.scratch;
  if (bytes < 0 || bytes > INT64_MAX / 4) {
    outOfMemory(lane, bytes);
    return nullptr;
  }
  int64_t rounded = (bytes + alignment - 1) / alignment * alignment;
  try {
    if (stack.blocks.empty() ||
        stack.used + rounded > stack.blocks[stack.block].capacity())
      nextBlock(lane, rounded);
  } catch (const OutOfMemory &refused) {
    outOfMemory(lane, refused.bytes);
    return nullptr;
  } catch (...) {
    outOfMemory(lane, rounded);
    return nullptr;
  }
  uint8_t *memory = stack.blocks[stack.block].data() + stack.used;
  stack.used += rounded;
  return memory;
}

int64_t pikoir_scratch_mark(pikoir_writer *writer) {
  const ScratchStack &stack = static_cast<Lane *>(writer)->scratch;
  return stack.below + stack.used;
}

void pikoir_scratch_release(pikoir_writer *writer, int64_t mark) {
  ScratchStack &stack = static_cast<Lane *>(writer)->scratch;
  while (mark < stack.below) {
    stack.used = stack.blocks[--stack.block].capacity();
    stack.below -= stack.used;
  }
  stack.used = std::clamp<int64_t>(mark - stack.below, 0, stack.used);
}

} // extern "C"
