// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Barrier.cpp - Barriers of blocks of PTX ----------------------------===//

#include "ptx/Decoder.h"
#include "ptx/Lanes.h"

using namespace piko::ptx;

namespace {

constexpr uint32_t barriers = 16;

/// All active lanes must name the same number.
uint32_t agreed(Warp &warp, Operand operand) {
  const auto *values = warp.lanes<uint32_t>(operand);
  const auto first = static_cast<uint32_t>(std::countr_zero(warp.active));
  forEachLane(warp.active, [&](uint32_t lane) {
    if (values[lane] != values[first])
      warp.fault(FaultKind::IllegalInstruction,
                 "barrier that lanes of a warp describe differently", lane);
  });
  return values[first];
}

/// it.a: its number, it.b: how many threads it waits for, 0 for all;
/// it.variant: whether a warp must come to it as one.
void synchronize(Warp &warp, const Instruction &it) {
  uint32_t barrier = agreed(warp, it.a), threads = agreed(warp, it.b);
  const auto lane = static_cast<uint32_t>(std::countr_zero(warp.active));
  if (barrier >= barriers)
    warp.fault(FaultKind::IllegalInstruction,
               "barrier " + std::to_string(barrier) + " of 16", lane);
  if (threads % warpSize)
    warp.fault(FaultKind::IllegalInstruction,
               "barrier of " + std::to_string(threads) +
                   " threads, which are no whole warps",
               lane);
  warp.waitAtBarrier(barrier, threads, it.variant);
}

} // namespace

bool piko::ptx::decodeBarrier(Decoding &d) {
  const bool isShort = d.base() == "bar";
  if (!isShort && d.base() != "barrier")
    return false;
  // bar.warp.sync is a warp operation.
  if (isShort && d.statement.opcode.starts_with("bar.warp"))
    return false;
  d.take("cta");
  if (!d.take("sync"))
    d.fail("expected .sync");
  d.it.variant = d.take("aligned") || isShort;
  d.finish(d.size() == 2 ? 2 : 1);
  constexpr Type number{Kind::Unsigned, 32};
  d.it.run = synchronize;
  d.it.counted = Class::Barrier;
  d.it.a = d.value(0, number);
  d.it.b = d.size() == 2 ? d.value(1, number) : d.scope.constant(0, 4);
  return true;
}
