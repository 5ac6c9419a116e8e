// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- FrameStrips.cpp - Strips that a frame repeats on the device --------===//
//
//   repeat { all that the strip holds, with loops and rounds; piko_strip }
//
// What leaves the strips waits in queues. A source that is one strip is taken
// as if there were none.
//
//===----------------------------------------------------------------------===//

#include "cuda/Frame.h"

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

std::vector<StripQueue> DeviceFrame::describeLeaving(int32_t group) const {
  std::vector<StripQueue> queues;
  for (size_t e = 0; e < p_.edges.size(); ++e) {
    const Edge &edge = p_.edges[e];
    if (edge.leavesStrips && p_.stages[edge.producer].stripGroup == group)
      queues.push_back({onDevice(&queues_[e]),
                        p_.records[p_.stages[edge.consumer].record].size});
  }
  return queues;
}

/// With those of what comes into loops.
std::vector<QueueState *> DeviceFrame::describeInside(int32_t group) const {
  std::vector<QueueState *> queues = describeWaiting([&](const Edge &edge) {
    return hasQueue(edge) && !edge.leavesStrips &&
           p_.stages[edge.producer].stripGroup == group;
  });
  for (int32_t s : p_.stripGroups[group].stages)
    if (p_.stages[s].loop >= 0)
      queues.push_back(onDevice(&entriesOf(s)));
  return queues;
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
