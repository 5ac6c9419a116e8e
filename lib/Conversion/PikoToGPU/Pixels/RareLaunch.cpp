// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A kernel that calls a function for rare primitives keeps across the call what
// its loops need, in registers or on the stack, and that where there is no rare
// primitive, too. So it has two launches:
//   1. groups of primitives up to the unit's first rare one, whose position is
//      left in the log: no call;
//   2. for units of which something was left, groups and rare primitives from
//      there on.
// Updates of a pixel keep their order: it is in one bin, which is in one unit,
// and the second launch begins where the first one ends.

#include "PikoToGPU/Pixels/CollapsedPixels.h"

#include "PikoToGPU/Emitter.h"

#include "Piko/Dialect/Piko/IR/Marks.h"

using namespace mlir;
using namespace piko;

using Predicate = arith::CmpIPredicate;

/// The first launch: a copy that takes units from their begin, and leaves them.
static void leaveUnits(RareSite &site, gpu::LaunchOp launch,
                       const IRMapping &copies) {
  auto copyOf = [&](Value value) { return copies.lookupOrDefault(value); };
  auto groups = cast<scf::WhileOp>(copies.lookup(site.groups.getOperation()));
  auto rest = cast<RestOp>(copies.lookup(site.rest.getOperation()));
  Emitter b(groups.getLoc(), groups);
  // Buckets after the one that was left are left, too.
  Value end = copyOf(site.end);
  groups->setOperand(0, b.select(copyOf(site.isLeft), end, copyOf(site.begin)));

  auto branch = cast<scf::IfOp>(copies.lookup(site.branch.getOperation()));
  while (Operation *op = branch.thenBlock()->getTerminator()->getPrevNode())
    op->erase();
  Emitter in(branch.getLoc(), branch.thenBlock()->getTerminator());
  Value thread = launch.getThreadIds().x;
  Emitter one = in.when(in.is(thread, Predicate::eq, in.index(0)));
  LeaveRestOp::create(one, rest.getLog(), rest.getUnit(),
                      copyOf(site.position));
  in.barrier();
  copies.lookup(site.next)->setOperand(1, end);
}

void piko::leaveRareToSecondLaunch(RareSite site, gpu::LaunchOp second) {
  OpBuilder builder(second);
  site.groups->setAttr(marks::blockValues, builder.getUnitAttr());
  IRMapping copies;
  auto first = cast<gpu::LaunchOp>(builder.clone(*second, copies));
  leaveUnits(site, first, copies);
  second->setAttr(marks::rest, builder.getUnitAttr());
  StringRef name = second.getFunctionAttr().getLeafReference();
  second.setFunctionAttr(
      FlatSymbolRefAttr::get(builder.getContext(), (name + "_rest").str()));
}
