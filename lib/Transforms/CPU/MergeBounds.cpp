// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-merge-bounds: fields of one element are read, or written, under one
// test of its index.

#include "Piko/Analysis/TargetModel.h"
#include "Piko/Transforms/Passes.h"
#include "Support/StateAccess.h"

#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/Dominance.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"
#include "llvm/ADT/MapVector.h"

namespace piko {
#define GEN_PASS_DEF_MERGEBOUNDS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct MergeBoundsPass : piko::impl::MergeBoundsBase<MergeBoundsPass> {
  void runOnOperation() override;
  void merge(KernelOp kernel);
  void merge(ArrayRef<scf::IfOp> tests);
  void mergeWrites(Block &block);
};

} // namespace

/// Whether all that a side of a condition does besides yielding is to fail.
static bool onlyFails(Region &side) {
  return llvm::all_of(side.front().without_terminator(), [](Operation &op) {
    return op.hasTrait<Failure>() || isMemoryEffectFree(&op) ||
           hasSingleEffect<MemoryEffects::Read>(&op);
  });
}

/// The read that a test guards, if the test has nothing else to do; or null.
static LoadOp getGuarded(scf::IfOp test) {
  if (test.getNumResults() != 1 || test.getElseRegion().empty())
    return {};
  auto load = dyn_cast<LoadOp>(test.thenBlock()->front());
  bool isAlone = load && load.getChecked() && !load.getTile() &&
                 load->getNextNode() == test.thenYield() &&
                 test.thenYield().getOperand(0) == load.getResult();
  Operation *other = test.elseYield().getOperand(0).getDefiningOp();
  return isAlone && onlyFails(test.getElseRegion()) &&
                 (!other || !test->isProperAncestor(other))
             ? load
             : LoadOp();
}

/// Whether a field shares its cache line with the rest of its record, so that
/// it costs little to read it along.
static bool isShort(LoadOp load) {
  Operation *state = lookupInPipeline<Operation *>(load, load.getStateAttr());
  RecordOp record = lookupRecord(state, getStateRecord(state));
  return record && record.getSize() <= lineSize;
}

/// Whether a read under conditions is as safe before them as another one
/// there. They may be what keeps an index inside; so it must be the same.
static bool readsAlong(LoadOp load, LoadOp first) {
  return isShort(load) && load.getIndices() == first.getIndices() &&
         (load.getElements().empty() ||
          load.getElements() == first.getElements());
}

void MergeBoundsPass::merge(ArrayRef<scf::IfOp> tests) {
  scf::IfOp first = tests.front();
  SmallVector<Type> types;
  SmallVector<Value> inside, outside;
  for (scf::IfOp test : tests) {
    types.push_back(test.getResult(0).getType());
    inside.push_back(test.thenYield().getOperand(0));
    outside.push_back(test.elseYield().getOperand(0));
  }
  OpBuilder builder(first);
  auto all = scf::IfOp::create(builder, first.getLoc(), types,
                               first.getCondition(), /*addThenBlock=*/false,
                               /*addElseBlock=*/false);
  all.getThenRegion().takeBody(first.getThenRegion());
  all.getElseRegion().takeBody(first.getElseRegion());
  // The others read after the first; what they say where they fail, it has
  // said.
  for (scf::IfOp test : tests.drop_front())
    getGuarded(test)->moveBefore(all.thenYield());
  all.thenYield().getResultsMutable().assign(inside);
  all.elseYield().getResultsMutable().assign(outside);
  for (auto [guard, result] : llvm::zip(tests, all.getResults())) {
    scf::IfOp test = guard;
    test.getResult(0).replaceAllUsesWith(result);
    test->erase();
  }
}

/// Whether an operation writes a field of any element of a piece of state, or
/// may; `isRead` whether it reads it, too.
static bool touches(Operation *op, FlatSymbolRefAttr state, StringAttr field,
                    bool isRead) {
  return op
      ->walk([&](Operation *inner) {
        auto [other, access] = getStateAccess(inner);
        if (other != state || (access == StateAccess::reads && !isRead))
          return WalkResult::advance();
        auto load = dyn_cast<LoadOp>(inner);
        auto store = dyn_cast<StoreOp>(inner);
        bool isOther = (load && load.getFieldAttr() != field) ||
                       (store && store.getFieldAttr() != field);
        return isOther ? WalkResult::advance() : WalkResult::interrupt();
      })
      .wasInterrupted();
}

/// Whether what a test guards is the same where another one stands before
/// it.
static bool isUnchanged(scf::IfOp test, scf::IfOp first) {
  LoadOp load = getGuarded(test);
  auto meets = [](Operation *op) {
    return op
        ->walk([](Operation *inner) {
          return isa<BarrierOpInterface, ParallelLoopOpInterface>(inner)
                     ? WalkResult::interrupt()
                     : WalkResult::advance();
        })
        .wasInterrupted();
  };
  for (Operation *op = first; op != test; op = op->getNextNode())
    if (meets(op) || touches(op, load.getStateAttr(), load.getFieldAttr(),
                             /*isRead=*/false))
      return false;
  return true;
}

void MergeBoundsPass::merge(KernelOp kernel) {
  llvm::DenseSet<StringAttr> written = getWrittenState(kernel);
  using Element = std::pair<Value, Attribute>;
  llvm::MapVector<Element, SmallVector<SmallVector<scf::IfOp>>> elements;
  DominanceInfo dominance;
  kernel.walk<WalkOrder::PreOrder>([&](scf::IfOp test) {
    LoadOp load = getGuarded(test);
    if (!load)
      return;
    bool isWritten = written.contains(load.getStateAttr().getAttr());
    auto &groups = elements[{test.getCondition(), load.getStateAttr()}];
    auto isKnown = [&](Value value, scf::IfOp first) {
      return dominance.properlyDominates(value, first);
    };
    for (SmallVector<scf::IfOp> &tests : groups) {
      scf::IfOp first = tests.front();
      bool isAfter = first->getBlock() == test->getBlock() ||
                     (!isWritten && readsAlong(load, getGuarded(first)) &&
                      first->getBlock()->findAncestorOpInBlock(*test));
      if (isAfter && !(isWritten && !isUnchanged(test, first)) &&
          llvm::all_of(load->getOperands(),
                       [&](Value value) { return isKnown(value, first); }) &&
          isKnown(test.elseYield().getOperand(0), first)) {
        tests.push_back(test);
        return;
      }
    }
    groups.push_back({test});
  });
  for (auto &[element, groups] : elements)
    for (SmallVector<scf::IfOp> &tests : groups)
      if (tests.size() > 1)
        merge(tests);
}

/// The writes that a test guards, if it has nothing else to do; or none.
static SmallVector<StoreOp> getWrites(scf::IfOp test) {
  SmallVector<StoreOp> writes;
  if (test.getNumResults() != 0 || test.getElseRegion().empty() ||
      !onlyFails(test.getElseRegion()))
    return {};
  for (Operation &op : test.thenBlock()->without_terminator()) {
    auto store = dyn_cast<StoreOp>(op);
    if (!store || !store.getChecked() || store.getTile() ||
        (!writes.empty() &&
         store.getStateAttr() != writes.front().getStateAttr()))
      return {};
    writes.push_back(store);
  }
  return writes;
}

/// Whether what a test guards may be done after an operation, too, and the
/// error that it may find be told.
static bool mayPass(Operation *op, scf::IfOp test, ArrayRef<StoreOp> writes) {
  if (isMemoryEffectFree(op))
    return true;
  for (StoreOp write : writes)
    if (touches(op, write.getStateAttr(), write.getFieldAttr(),
                /*isRead=*/true))
      return false;
  if (isa<LoadOp, StoreOp>(op))
    return true;
  auto other = dyn_cast<scf::IfOp>(op);
  return other && other.getCondition() == test.getCondition() &&
         getGuarded(other);
}

/// A test that is made again for other fields guards them all: the writes of
/// the first one are done where the last one stands.
void MergeBoundsPass::mergeWrites(Block &block) {
  scf::IfOp test;
  SmallVector<StoreOp> writes;
  for (Operation &op : block) {
    auto next = dyn_cast<scf::IfOp>(op);
    SmallVector<StoreOp> more = next ? getWrites(next) : SmallVector<StoreOp>();
    bool joins = test && next && !more.empty() &&
                 next.getCondition() == test.getCondition() &&
                 more.front().getStateAttr() == writes.front().getStateAttr();
    if (joins) {
      Operation *front = &next.thenBlock()->front();
      for (StoreOp write : writes)
        write->moveBefore(front);
      test.erase();
    } else if (test && mayPass(&op, test, writes)) {
      continue;
    }
    test = next && !more.empty() ? next : scf::IfOp();
    writes = test ? getWrites(test) : SmallVector<StoreOp>();
  }
}

void MergeBoundsPass::runOnOperation() {
  for (auto kernel : getOperation().getOps<KernelOp>()) {
    merge(kernel);
    kernel.walk([&](Block *block) { mergeWrites(*block); });
  }
}
