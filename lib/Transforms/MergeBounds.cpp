// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-merge-bounds: fields of one element are read behind one test of its
// index.

#include "Piko/Transforms/Passes.h"
#include "StateAccess.h"

#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/Dominance.h"
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
};

} // namespace

/// Whether all that a side of a condition does besides yielding is to fail.
static bool onlyFails(Region &side) {
  return llvm::all_of(side.front().without_terminator(), [](Operation &op) {
    return op.hasTrait<Failure>() || isMemoryEffectFree(&op);
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
  constexpr int64_t lineSize = 64;
  Operation *state = lookupInPipeline<Operation *>(load, load.getStateAttr());
  RecordOp record = lookupRecord(state, getStateRecord(state));
  return record && record.getSize() <= lineSize;
}

/// Whether a read behind conditions is as safe in front of them as another one
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
  // The others read behind the first; what they say where they fail, it has
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
  merged += tests.size() - 1;
}

void MergeBoundsPass::merge(KernelOp kernel) {
  llvm::DenseSet<StringAttr> written = getWrittenState(kernel);
  using Element = std::pair<Value, Attribute>;
  llvm::MapVector<Element, SmallVector<SmallVector<scf::IfOp>>> elements;
  DominanceInfo dominance;
  kernel.walk<WalkOrder::PreOrder>([&](scf::IfOp test) {
    LoadOp load = getGuarded(test);
    if (!load || written.contains(load.getStateAttr().getAttr()))
      return;
    auto &groups = elements[{test.getCondition(), load.getStateAttr()}];
    auto isKnown = [&](Value value, scf::IfOp first) {
      return dominance.properlyDominates(value, first);
    };
    for (SmallVector<scf::IfOp> &tests : groups) {
      scf::IfOp first = tests.front();
      bool isBehind = first->getBlock() == test->getBlock() ||
                      (readsAlong(load, getGuarded(first)) &&
                       first->getBlock()->findAncestorOpInBlock(*test));
      if (isBehind &&
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

void MergeBoundsPass::runOnOperation() {
  for (auto kernel : getOperation().getOps<KernelOp>())
    merge(kernel);
}
