// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-combine-bounds: indices that do not depend on each other's elements are
// tested at once, for all lanes:
//   1. tests of a block whose indices vary alike become neighbours;
//   2. a vote that all hold guards the reads of all, and where it does not hold
//      each has its own test.

#include "Piko/Analysis/BranchProbability.h"
#include "Piko/Transforms/Passes.h"
#include "Support/StateAccess.h"

#include "Piko/Dialect/Piko/IR/CodeBuilder.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/IR/Dominance.h"
#include "mlir/IR/IRMapping.h"
#include "mlir/IR/PatternMatch.h"
#include "mlir/Interfaces/LoopLikeInterface.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"
#include "mlir/Transforms/RegionUtils.h"
#include "llvm/ADT/MapVector.h"
#include "llvm/ADT/SetVector.h"

namespace piko {
#define GEN_PASS_DEF_COMBINEBOUNDS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct CombineBoundsPass : piko::impl::CombineBoundsBase<CombineBoundsPass> {
  using CombineBoundsBase::CombineBoundsBase;
  void runOnOperation() override;
};

/// What an index is computed from that changes in a loop: its iterations'
/// arguments, and what is not looked into.
using Leaves = SmallVector<Value>;

/// Tests that can be made where the first of them stands.
struct Group {
  SmallVector<scf::IfOp> tests;
  Leaves leaves;
};

/// Combines the tests of a block.
class Combiner {
public:
  Combiner(Block &block, const llvm::DenseSet<StringAttr> &written,
           DominanceInfo &dominance, size_t most)
      : block(block), written(written), dominance(dominance), most(most) {}

  void run();

private:
  void add(scf::IfOp test);
  bool join(Group &group, scf::IfOp test);
  void closeFor(Operation &op);

  Block &block;
  const llvm::DenseSet<StringAttr> &written;
  DominanceInfo &dominance;
  size_t most;
  SmallVector<Group> open, closed;
};

} // namespace

//===----------------------------------------------------------------------===//
// Tests
//===----------------------------------------------------------------------===//

static bool isCheckedRead(Operation &op) {
  auto load = dyn_cast<LoadOp>(op);
  return load && load.getChecked() && !load.getTile();
}

/// Whether a condition guards reads, and reports an error where it fails, and
/// has nothing else to do.
static bool isTest(scf::IfOp test) {
  if (test.getNumResults() == 0 || test.getElseRegion().empty())
    return false;
  bool fails = false;
  for (Operation &op : test.elseBlock()->without_terminator()) {
    bool isFailure = op.hasTrait<Failure>();
    if (!isFailure && !isPure(&op))
      return false;
    fails |= isFailure;
  }
  return fails &&
         llvm::all_of(test.thenBlock()->without_terminator(), isCheckedRead);
}

/// The values that a test has from where it stands.
static SmallVector<Value> getInputs(scf::IfOp test) {
  llvm::SetVector<Value> values;
  values.insert(test.getCondition());
  getUsedValuesDefinedAbove(test.getThenRegion(), values);
  getUsedValuesDefinedAbove(test.getElseRegion(), values);
  return values.takeVector();
}

/// Sorted; nothing where there is too much to look into. The elements that a
/// test reads vary as its index does.
static std::optional<Leaves> findLeaves(Value value) {
  constexpr size_t most = 1024;
  llvm::SetVector<Value> all;
  Leaves leaves;
  all.insert(value);
  for (size_t i = 0; i < all.size(); ++i) {
    if (all.size() > most)
      return std::nullopt;
    Operation *op = all[i].getDefiningOp();
    if (!op) {
      auto argument = cast<BlockArgument>(all[i]);
      if (isa<LoopLikeOpInterface>(argument.getOwner()->getParentOp()))
        leaves.push_back(argument);
    } else if (auto test = dyn_cast<scf::IfOp>(op); test && isTest(test)) {
      all.insert(test.getCondition());
      for (Operation &read : test.thenBlock()->without_terminator())
        for (Value operand : read.getOperands())
          if (!test->isProperAncestor(operand.getParentBlock()->getParentOp()))
            all.insert(operand);
    } else if (op->getNumRegions() == 0 && (isPure(op) || isa<LoadOp>(op))) {
      all.insert_range(op->getOperands());
    } else {
      leaves.push_back(all[i]);
    }
  }
  llvm::sort(leaves, [](Value a, Value b) {
    return a.getAsOpaquePointer() < b.getAsOpaquePointer();
  });
  return leaves;
}

//===----------------------------------------------------------------------===//
// Neighbours
//===----------------------------------------------------------------------===//

bool Combiner::join(Group &group, scf::IfOp test) {
  IRRewriter rewriter(test.getContext());
  if (failed(moveValueDefinitions(rewriter, getInputs(test),
                                  group.tests.front(), dominance)))
    return false;
  test->moveAfter(group.tests.back());
  group.tests.push_back(test);
  return true;
}

void Combiner::add(scf::IfOp test) {
  std::optional<Leaves> leaves = findLeaves(test.getCondition());
  if (!leaves)
    return;
  for (Group &group : open)
    if (group.tests.size() < most && group.leaves == *leaves &&
        join(group, test))
      return;
  open.push_back({{test}, std::move(*leaves)});
}

/// Reads of what an operation may change stay after it, and no read passes
/// where iterations meet, or a part of the program that has branches.
void Combiner::closeFor(Operation &op) {
  if (isMemoryEffectFree(&op) && op.getNumRegions() == 0)
    return;
  auto [state, access] = getStateAccess(&op);
  bool changes = op.getNumRegions() > 0 || isa<BarrierOpInterface>(op) ||
                 (state && written.contains(state.getAttr()) &&
                  access != int(StateAccess::reads));
  if (!changes)
    return;
  llvm::append_range(closed, std::move(open));
  open.clear();
}

//===----------------------------------------------------------------------===//
// One test
//===----------------------------------------------------------------------===//

/// The largest of two indices. Both may be numbers of 32 bits whose sign is
/// extended: so is their largest one, as a negative one is larger than others.
static Value createLargest(CodeBuilder at, Value a, Value b) {
  auto narrow = [](Value index) {
    auto cast = index.getDefiningOp<arith::IndexCastOp>();
    return cast && cast.getIn().getType().isInteger(32) ? cast.getIn()
                                                        : Value();
  };
  if (narrow(a) && narrow(b))
    return arith::IndexCastOp::create(
        at.builder, at.loc, a.getType(),
        arith::MaxUIOp::create(at.builder, at.loc, narrow(a), narrow(b)));
  return arith::MaxUIOp::create(at.builder, at.loc, a, b);
}

/// Whether all tests hold. Tests of one index against several sizes compare it
/// with the least, which is the same for a whole loop; those of several against
/// one size compare the largest.
static Value createAll(CodeBuilder at, ArrayRef<scf::IfOp> tests) {
  if (tests.size() == 1)
    return scf::IfOp(tests.front()).getCondition();
  using Values = llvm::SetVector<Value>;
  llvm::MapVector<Value, Values> limits; // of indices
  Values others;
  for (scf::IfOp test : tests) {
    auto compare = test.getCondition().getDefiningOp<arith::CmpIOp>();
    if (compare && compare.getPredicate() == CodeBuilder::P::ult &&
        compare.getLhs().getType().isIndex())
      limits[compare.getLhs()].insert(compare.getRhs());
    else
      others.insert(test.getCondition());
  }
  llvm::MapVector<Value, Value> largest; // by limit
  for (auto &[index, sizes] : limits) {
    Value least = sizes.front();
    for (Value size : llvm::drop_begin(sizes))
      least = arith::MinUIOp::create(at.builder, at.loc, least, size);
    Value &known = largest[least];
    known = known ? createLargest(at, known, index) : index;
  }
  Value all;
  for (auto [limit, index] : largest)
    others.insert(at.compare(CodeBuilder::P::ult, index, limit));
  for (Value condition : others)
    all = all ? at.both(all, condition) : condition;
  return all;
}

static void combine(ArrayRef<scf::IfOp> tests) {
  scf::IfOp first = tests.front();
  OpBuilder builder(first);
  CodeBuilder at(builder, first.getLoc());
  SmallVector<Type> types;
  for (scf::IfOp test : tests)
    llvm::append_range(types, test.getResultTypes());
  Value vote = VoteOp::create(builder, first.getLoc(), createAll(at, tests));
  auto all = scf::IfOp::create(builder, first.getLoc(), types, vote,
                               /*withElseRegion=*/true);
  constexpr double nearlyAlways = 1 - 1e-6;
  setProbability(all, nearlyAlways);
  SmallVector<Value> reads, results;
  builder.setInsertionPointToStart(all.thenBlock());
  for (scf::IfOp test : tests) {
    IRMapping copies;
    for (Operation &read : test.thenBlock()->without_terminator())
      builder.clone(read, copies);
    for (Value value : test.thenYield().getResults())
      reads.push_back(copies.lookupOrDefault(value));
  }
  scf::YieldOp::create(builder, first.getLoc(), reads);
  unsigned next = 0;
  for (scf::IfOp test : tests) {
    for (Value result : test.getResults()) {
      result.replaceAllUsesWith(all.getResult(next++));
      results.push_back(result);
    }
    test->moveBefore(all.elseBlock(), all.elseBlock()->end());
  }
  builder.setInsertionPointToEnd(all.elseBlock());
  scf::YieldOp::create(builder, first.getLoc(), results);
}

void Combiner::run() {
  for (Operation &op : llvm::make_early_inc_range(block)) {
    auto test = dyn_cast<scf::IfOp>(op);
    if (test && isTest(test))
      add(test);
    else
      closeFor(op);
  }
  llvm::append_range(closed, std::move(open));
  for (const Group &group : closed)
    combine(group.tests);
}

void CombineBoundsPass::runOnOperation() {
  for (auto kernel : getOperation().getOps<KernelOp>()) {
    llvm::DenseSet<StringAttr> written = getWrittenState(kernel);
    DominanceInfo dominance(kernel);
    SmallVector<Block *> blocks;
    kernel.walk([&](Block *block) {
      auto around = dyn_cast<scf::IfOp>(block->getParentOp());
      if (!around || !around.getCondition().getDefiningOp<VoteOp>())
        blocks.push_back(block);
    });
    for (Block *block : blocks)
      Combiner(*block, written, dominance, maxTests).run();
  }
}
