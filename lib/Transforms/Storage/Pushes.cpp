// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What becomes of loops that push to lists: room behind the lists for whole
// vectors, and loads and stores where no vector or thread took the loop.

#include "Piko/Transforms/Storage/Appends.h"

#include "Piko/Dialect/Piko/IR/CodeBuilder.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"

using namespace mlir;
using namespace piko;

/// Whether what stands in an array is what a push has put there, if anything:
/// it alone fills it, in one loop that runs once.
static bool isFilledOnce(PushOp push, Value array, scf::ForOp loop) {
  for (Operation *user : array.getUsers())
    if (user != push && !isa<memref::LoadOp>(user))
      return false;
  Block *block = array.getParentBlock();
  for (Operation *at = loop; at->getBlock() != block;) {
    at = at->getParentOp();
    if (!isa_and_nonnull<scf::IfOp>(at))
      return false;
  }
  return true;
}

void piko::padLists(scf::ForOp loop, int64_t laneCount) {
  loop.walk([&](PushOp push) {
    if (!llvm::all_of(push.getArrays(), [&](Value array) {
          return isFilledOnce(push, array, loop);
        }))
      return;
    for (Value array : push.getArrays()) {
      MemRefType type = cast<MemRefType>(array.getType());
      array.setType(MemRefType::get({type.getNumElements() + laneCount},
                                    type.getElementType()));
    }
    push.setPadded(true);
  });
}

void piko::explainNoPushes(InFlightDiagnostic &remark, Location refusal) {
  remark << "this loop appends one element after the other";
  remark.attachNote(refusal)
      << "here a list, or its length, is used for something else";
}

void piko::expandPushes(scf::ForOp loop) {
  SmallVector<PushOp> pushes;
  loop.walk([&](PushOp push) { pushes.push_back(push); });
  for (PushOp push : pushes) {
    OpBuilder builder(push);
    CodeBuilder at(builder, push.getLoc());
    Value zero = at.index(0), count = at.load(push.getCount(), zero);
    auto write = [&] {
      Type index = builder.getIndexType();
      Value place = count;
      if (!count.getType().isIndex())
        place =
            arith::IndexCastOp::create(builder, push.getLoc(), index, count);
      at.store(push.getValues(), push.getArrays(), place);
      Value one = arith::ConstantOp::create(
          builder, push.getLoc(), builder.getIntegerAttr(count.getType(), 1));
      at.store(at.add(count, one), push.getCount(), zero);
    };
    if (Value limit = push.getLimit())
      at.when(at.compare(push.getIsUnsigned() ? CodeBuilder::P::ult
                                              : CodeBuilder::P::slt,
                         count, limit),
              write);
    else
      write();
    push.erase();
  }
}
