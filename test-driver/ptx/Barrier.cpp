// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//===- Barrier.cpp - Barriers and sleeps of PTX ---------------------------===//

#include "ptx/Lanes.h"
#include "ptx/text/Decoder.h"

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

/// However long: what is waited for may be another block's.
void sleep(Warp &warp, const Instruction &) { warp.sleepInLoop(); }

bool decodeSleep(Decoding &d) {
  constexpr Type nanoseconds{Kind::Unsigned, 32};
  if (d.takeType() != nanoseconds)
    d.fail("expected .u32");
  d.finish(1);
  d.it.run = sleep;
  d.it.counted = Class::Control;
  d.it.a = d.value(0, nanoseconds);
  return true;
}

/// The reduction that bar.red names, and its predicate.
Reduction takeReduction(Decoding &d) {
  const Type type = d.takeType();
  const Reduction reduction = d.take("popc")  ? Reduction::Count
                              : d.take("and") ? Reduction::All
                              : d.take("or")  ? Reduction::Any
                                              : Reduction::None;
  if (reduction == Reduction::None ||
      type.isPredicate() == (reduction == Reduction::Count))
    d.fail("expected a reduction that is known");
  d.it.result = d.result(0, type);
  d.it.c = d.predicate(d.size() - 1, &d.it.negated);
  return reduction;
}

} // namespace

bool piko::ptx::decodeBarrier(Decoding &d) {
  if (d.base() == "nanosleep")
    return decodeSleep(d);
  const bool isShort = d.base() == "bar";
  if (!isShort && d.base() != "barrier")
    return false;
  // bar.warp.sync is a warp operation.
  if (isShort && d.statement.opcode.starts_with("bar.warp"))
    return false;
  d.take("cta");
  const bool reduces = d.take("red");
  if (!reduces && !d.take("sync"))
    d.fail("expected .sync or .red");
  d.it.variant = d.take("aligned") || isShort;
  if (reduces)
    d.it.extra = static_cast<uint32_t>(takeReduction(d));
  // Between a result and a predicate, if it reduces.
  const size_t first = reduces ? 1 : 0, around = reduces ? 2 : 0;
  const bool hasThreads = d.size() == around + 2;
  d.finish(around + (hasThreads ? 2 : 1));
  constexpr Type number{Kind::Unsigned, 32};
  d.it.run = synchronize;
  d.it.counted = Class::Barrier;
  d.it.a = d.value(first, number);
  d.it.b = hasThreads ? d.value(first + 1, number) : d.scope.constant(0, 4);
  return true;
}
