// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- FrameStrips.cpp - Strips that a frame repeats on the device --------===//
//
//   repeat { all that the strip holds, with loops and rounds; piko_strip }
//
// What leaves the strips waits in queues. A source that is one strip is taken
// as if there were none.
//
//===----------------------------------------------------------------------===//

#include "cuda/frame/Frame.h"

using namespace piko::cuda;
using namespace piko::rt;

void DeviceFrame::beginStrips(int32_t group, int64_t size) {
  StripRecord &strips = strips_[static_cast<size_t>(group)];
  int64_t all = p_.sources[p_.stripGroups[group].source].count;
  strips.state = exchange_.take<StripState>();
  *strips.state = {.again = 1,
                   .number = 0,
                   .begin = 0,
                   .count = std::min(size, all),
                   .size = std::min(size, all),
                   .all = all,
                   .memory = 0};
  strips.isDivided = size < all;
  if (strips.isDivided)
    repeat(strips.state->again);
}

void DeviceFrame::endStrips(int32_t group) {
  if (!strips_[static_cast<size_t>(group)].isDivided)
    return;
  std::vector<StripQueue> leaving = describeLeaving(group);
  std::vector<QueueState *> inside = describeInside(group);
  std::vector<CycleState *> cycles;
  for (size_t c = 0; c < p_.cycles.size(); ++c)
    if (p_.stages[p_.cycles[c].stages.front()].stripGroup == group)
      cycles.push_back(onDevice(&cycles_[c]));
  auto &args = exchange_.takeWith<StripArgs>(leaving, inside, cycles);
  StripState *strip = strips_[static_cast<size_t>(group)].state;
  args.frame = onDevice(frame_);
  args.strip = onDevice(strip);
  args.number = nextNumber();
  args.leavingCount = static_cast<int32_t>(leaving.size());
  args.insideCount = static_cast<int32_t>(inside.size());
  args.cycleCount = static_cast<int32_t>(cycles.size());
  launchOwn("piko_strip", &args);
  endRepeat(strip->again);
}
