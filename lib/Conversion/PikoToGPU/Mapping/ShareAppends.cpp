// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-share-appends: has the threads of a block share loops that append to
// lists, by stream compaction. Strips of iterations find out at once whether
// they append; a prefix sum says where.

#include "Piko/Conversion/Passes.h"
#include "Piko/Dialect/Piko/IR/CodeBuilder.h"
#include "Piko/Transforms/Storage/Appends.h"

#include "mlir/IR/Matchers.h"

namespace piko {
#define GEN_PASS_DEF_SHAREAPPENDS
#include "Piko/Conversion/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct ShareAppendsPass : piko::impl::ShareAppendsBase<ShareAppendsPass> {
  using ShareAppendsBase::ShareAppendsBase;
  void runOnOperation() override;
};

/// Writes what threads do instead of the iterations of a loop that pushes.
class StripWriter {
public:
  StripWriter(scf::ForOp loop, int64_t size)
      : loop(loop), size(size), builder(loop), code(builder, loop.getLoc()) {}
  void write();

private:
  /// What an iteration pushes, once it has come to its end.
  struct Pushed {
    Value flag, known;
    SmallVector<Value> values;
  };
  Value allocate(Type type);
  Pushed takeOut(PushOp push, Value known);
  Value addUp(Value flag);
  void append(PushOp push, const Pushed &pushed, Value isLast);

  scf::ForOp loop;
  int64_t size; ///< Of a strip.
  OpBuilder builder;
  CodeBuilder code;
};

} // namespace

//===----------------------------------------------------------------------===//
// Legality
//===----------------------------------------------------------------------===//

/// What a kernel changes of state.
static llvm::DenseSet<Attribute> findWritten(KernelOp kernel) {
  llvm::DenseSet<Attribute> written;
  kernel.walk([&](StateAccessOpInterface access) {
    if (access.getAccessKinds() != StateAccess::reads)
      written.insert(access.getAccessedState());
  });
  return written;
}

/// Whether iterations only read, and push.
static bool onlyPushes(scf::ForOp loop,
                       const llvm::DenseSet<Attribute> &written) {
  llvm::DenseSet<Value> pushed;
  loop.walk([&](PushOp push) {
    pushed.insert_range(push.getArrays());
    pushed.insert(push.getCount());
  });
  return !loop.getBody()
              ->walk([&](Operation *op) {
                auto load = dyn_cast<LoadOp>(op);
                auto read = dyn_cast<memref::LoadOp>(op);
                bool isKnown =
                    isa<PushOp, scf::IfOp, scf::ForOp, scf::WhileOp,
                        scf::IndexSwitchOp, ListAtOp>(op) ||
                    (op->getNumRegions() == 0 && isMemoryEffectFree(op)) ||
                    (load && !written.contains(load.getStateAttr())) ||
                    (read && !pushed.contains(read.getMemRef()));
                return isKnown ? WalkResult::advance()
                               : WalkResult::interrupt();
              })
              .wasInterrupted();
}

/// Whether a loop is done by all threads of a block alike: they go there
/// together, as nothing around it is theirs alone.
static bool isOfBlock(Operation *op) {
  for (Operation *at = op->getParentOp(); at; at = at->getParentOp()) {
    if (isa<ListsOp>(at))
      return true;
    if (!isa<scf::IfOp, scf::ForOp, scf::WhileOp, scf::IndexSwitchOp>(at))
      return false;
  }
  return false;
}

//===----------------------------------------------------------------------===//
// Rewriting
//===----------------------------------------------------------------------===//

/// A number of an iteration, which is zero first.
Value StripWriter::allocate(Type type) {
  Value memory =
      memref::AllocaOp::create(builder, code.loc, MemRefType::get({1}, type));
  Value zero =
      arith::ConstantOp::create(builder, code.loc, builder.getZeroAttr(type));
  code.store(zero, memory, code.index(0));
  return memory;
}

/// Notes what is pushed, at whatever place of an iteration, for its end.
StripWriter::Pushed StripWriter::takeOut(PushOp push, Value known) {
  Block *body = builder.getInsertionBlock();
  builder.setInsertionPointToStart(body);
  Value flag = allocate(builder.getI32Type());
  SmallVector<Value> values;
  for (Type type : push.getValues().getTypes())
    values.push_back(allocate(type));
  builder.setInsertionPoint(push);
  Value one = arith::ConstantOp::create(builder, code.loc,
                                        builder.getI32IntegerAttr(1));
  Value zero = code.index(0);
  code.store(one, flag, zero);
  for (auto [value, memory] : llvm::zip(push.getValues(), values))
    code.store(value, memory, zero);
  builder.setInsertionPointToEnd(body);
  zero = code.index(0);
  return {code.load(flag, zero), known, code.load(values, zero)};
}

/// How many of the iterations before push.
Value StripWriter::addUp(Value flag) {
  Value none = arith::ConstantOp::create(builder, code.loc,
                                         builder.getI32IntegerAttr(0));
  auto scan = ScanOp::create(builder, code.loc, flag.getType(), flag, none);
  OpBuilder::InsertionGuard guard(builder);
  Block *block =
      builder.createBlock(&scan.getBody(), {}, {flag.getType(), flag.getType()},
                          {code.loc, code.loc});
  Value sum = code.add(block->getArgument(0), block->getArgument(1));
  YieldOp::create(builder, code.loc, /*pixel=*/ValueRange(), ValueRange(sum));
  return scan.getResult(0);
}

void StripWriter::append(PushOp push, const Pushed &pushed, Value isLast) {
  Type type = pushed.known.getType();
  auto widen = [&](Value number) -> Value {
    if (type.isIndex())
      return arith::IndexCastUIOp::create(builder, code.loc, type, number);
    return type == number.getType()
               ? number
               : arith::ExtUIOp::create(builder, code.loc, type, number)
                     .getResult();
  };
  Value before = widen(addUp(pushed.flag)), flag = widen(pushed.flag);
  Value all = code.add(before, flag);
  auto isLess = [&](Value a, Value b) {
    return code.compare(CodeBuilder::P::ult, a, b);
  };
  Value pushes = isLess(before, all);
  if (Value limit = push.getLimit()) {
    // Sums of counts that are too long already may be too large.
    Value hasRoom = code.compare(push.getIsUnsigned() ? CodeBuilder::P::ult
                                                      : CodeBuilder::P::slt,
                                 pushed.known, limit);
    Value none =
        arith::ConstantOp::create(builder, code.loc, builder.getZeroAttr(type));
    Value room = code.select(hasRoom, code.sub(limit, pushed.known), none);
    pushes = code.both(pushes, isLess(before, room));
    all = code.select(isLess(all, room), all, room);
  }
  Value place = code.add(pushed.known, before),
        next = code.add(pushed.known, all);
  code.when(pushes, [&] {
    Value at = place;
    if (!type.isIndex())
      at = arith::IndexCastOp::create(builder, code.loc, builder.getIndexType(),
                                      place);
    code.store(pushed.values, push.getArrays(), at);
  });
  code.when(isLast, [&] { code.store(next, push.getCount(), code.index(0)); });
  push.erase();
}

void StripWriter::write() {
  Value lower = loop.getLowerBound(), upper = loop.getUpperBound();
  auto strips =
      scf::ForOp::create(builder, code.loc, lower, upper, code.index(size));
  builder.setInsertionPointToStart(strips.getBody());
  Value first = strips.getInductionVar();
  Value count = code.min(code.sub(upper, first), code.index(size));
  SmallVector<PushOp> pushes;
  loop.walk([&](PushOp push) { pushes.push_back(push); });
  SmallVector<Value> known;
  for (PushOp push : pushes)
    known.push_back(code.load(push.getCount(), code.index(0)));
  auto parallel = ParallelForOp::create(builder, code.loc, count);
  Block *body = builder.createBlock(&parallel.getBody(), {},
                                    builder.getIndexType(), code.loc);
  Value iteration = parallel.getIteration();
  loop.getInductionVar().replaceAllUsesWith(code.add(first, iteration));
  loop.getBody()->getTerminator()->erase();
  body->getOperations().splice(body->end(), loop.getBody()->getOperations());
  SmallVector<Pushed> pushed;
  for (auto [push, length] : llvm::zip(pushes, known))
    pushed.push_back(takeOut(push, length));
  Value isLast = code.compare(CodeBuilder::P::eq,
                              code.add(iteration, code.index(1)), count);
  for (auto [push, what] : llvm::zip(pushes, pushed))
    append(push, what, isLast);
  YieldOp::create(builder, code.loc, /*pixel=*/ValueRange(), ValueRange());
  loop.erase();
}

/// Instead of a loop that may be short, one or the other.
static void share(scf::ForOp loop, int64_t size, int64_t least) {
  std::optional<APInt> known = loop.getStaticTripCount();
  if (known) {
    StripWriter(loop, size).write();
    return;
  }
  OpBuilder builder(loop);
  CodeBuilder code(builder, loop.getLoc());
  Value count = code.sub(loop.getUpperBound(), loop.getLowerBound());
  Value isLong = code.compare(CodeBuilder::P::sge, count, code.index(least));
  auto choice = scf::IfOp::create(builder, loop.getLoc(), isLong,
                                  /*withElse=*/true);
  builder.setInsertionPointToStart(choice.elseBlock());
  expandPushes(cast<scf::ForOp>(builder.clone(*loop)));
  loop->moveBefore(choice.thenBlock()->getTerminator());
  StripWriter(loop, size).write();
}

void ShareAppendsPass::runOnOperation() {
  // With fewer iterations a thread is as fast as the barriers of many.
  constexpr int64_t least = 64;
  SmallVector<Operation *> loops;
  getOperation().walk([&](Operation *op) {
    if (isa<scf::ForOp, scf::WhileOp>(op) && op->getNumResults() > 0 &&
        isOfBlock(op))
      loops.push_back(op);
  });
  for (Operation *op : loops) {
    std::optional<Location> refusal;
    std::optional<PushLoop> made = copyAsPushes(op, refusal);
    if (!made) {
      if (refusal) {
        InFlightDiagnostic remark = emitRemark(op->getLoc());
        explainNoPushes(remark, *refusal);
      }
      continue;
    }
    std::optional<APInt> known = made->loop.getStaticTripCount();
    if (!made->loop.getUpperBound().getType().isIndex() ||
        made->loop.getUnsignedCmp() ||
        !matchPattern(made->loop.getStep(), m_One()) ||
        (known && known->slt(least)) ||
        !onlyPushes(made->loop, findWritten(op->getParentOfType<KernelOp>()))) {
      made->erase();
      continue;
    }
    emitRemark(op->getLoc(), "iterations of this loop append in order, by "
                             "stream compaction, and threads share them");
    op->replaceAllUsesWith(made->results);
    op->erase();
    share(made->loop, stripSize, least);
  }
}
