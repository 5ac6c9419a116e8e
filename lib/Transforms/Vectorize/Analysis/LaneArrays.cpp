// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Arrays in records, as lanes read them. Of an array of up to 4 elements lanes
// read all, where they need different ones. Elements of a primitive's array of
// up to 64 that loops are expected to read four times or more are gathered
// before the loops.

#include "Vectorize/Analysis/LaneArrays.h"

#include "Vectorize/Analysis/IterationLanes.h"

#include "Piko/Analysis/Expectations.h"
#include "Piko/Analysis/Uniformity.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/IR/Matchers.h"
#include "mlir/IR/PatternMatch.h"
#include "llvm/ADT/MapVector.h"

using namespace mlir;
using namespace piko;

void piko::readAllElements(scf::ForOp root) {
  constexpr int64_t most = 4;
  SmallVector<LoadOp> loads;
  root.walk([&](LoadOp load) {
    if (!llvm::all_of(load.getElements(), [](Value element) {
          return matchPattern(element, m_Constant());
        }))
      loads.push_back(load);
  });
  if (loads.empty())
    return;
  Uniformity uniformity(root, {{root.getInductionVar(), Uniform::Iteration}});
  for (LoadOp load : loads) {
    Operation *state =
        SymbolTable::lookupSymbolIn(getPipeline(load), load.getStateAttr());
    RecordOp record = lookupRecord(load, getStateRecord(state));
    ArrayRef<int64_t> counts = record.getField(load.getField()).getCounts();
    SmallVector<Value> elements(load.getElements());
    auto varies = [&](Value element) { return uniformity.isVarying(element); };
    auto one = llvm::find_if(elements, varies);
    if (llvm::count_if(elements, varies) != 1 ||
        counts[one - elements.begin()] > most)
      continue;
    IRRewriter builder(load);
    Value value;
    for (int64_t i = 0; i < counts[one - elements.begin()]; ++i) {
      Value number = arith::ConstantIndexOp::create(builder, load.getLoc(), i);
      auto read = cast<LoadOp>(builder.clone(*load));
      read.getElementsMutable()[one - elements.begin()].assign(number);
      Value isIt = arith::CmpIOp::create(
          builder, load.getLoc(), arith::CmpIPredicate::eq, *one, number);
      value = value ? arith::SelectOp::create(builder, load.getLoc(), isIt,
                                              read.getResult(), value)
                    : read.getResult();
    }
    builder.replaceOp(load, value);
  }
}

/// How often loops inside of a root come to an operation; 1 if it is in none.
static double countIterationsAround(Operation *op, scf::ForOp root) {
  double iterations = 1;
  for (Operation *at = op->getParentOp(); at != root; at = at->getParentOp())
    if (isa<scf::ForOp, scf::WhileOp>(at))
      iterations *=
          getExpectedIterations(at).value_or(expected::differingIterations);
  return iterations;
}

/// The number of elements of an array that a loop reads at a place which is the
/// same for all lanes, of the primitive that the iteration of the root has; 0
/// if it is another read.
static int64_t countElements(GetOp get, scf::ForOp root,
                             const Uniformity &uniformity) {
  auto item = get.getPrim().getDefiningOp<ItemOp>();
  if (!item || item->getBlock() != root.getBody() ||
      get->getBlock() == root.getBody() || get.getElements().size() != 1 ||
      get.getType().isInteger(1) ||
      matchPattern(get.getElements().front(), m_Constant()) ||
      uniformity.isVarying(get.getElements().front()))
    return 0;
  RecordOp record = lookupRecord(get, get.getPrim().getType().getRecord());
  return record.getField(get.getField()).getCounts().front();
}

static memref::AllocaOp copyArray(GetOp like, int64_t count) {
  OpBuilder builder(like);
  builder.setInsertionPointAfter(like.getPrim().getDefiningOp());
  Location loc = like.getLoc();
  auto array = memref::AllocaOp::create(
      builder, loc, MemRefType::get({count}, like.getType()));
  for (int64_t i = 0; i < count; ++i) {
    Value place = arith::ConstantIndexOp::create(builder, loc, i);
    auto element = cast<GetOp>(builder.clone(*like));
    element.getElementsMutable().assign(place);
    memref::StoreOp::create(builder, loc, element.getResult(), array, place);
  }
  return array;
}

void piko::copyItemArrays(scf::ForOp root) {
  constexpr int64_t mostElements = 64;
  constexpr double leastReads = 4; // of each element
  Uniformity uniformity(root, {{root.getInductionVar(), Uniform::Iteration}},
                        /*isLockstep=*/true);
  llvm::MapVector<std::pair<Value, StringAttr>, SmallVector<GetOp>> arrays;
  root.walk([&](GetOp get) {
    int64_t count = countElements(get, root, uniformity);
    if (count > 0 && count <= mostElements &&
        countIterationsAround(get, root) >= leastReads * double(count))
      arrays[{get.getPrim(), get.getFieldAttr()}].push_back(get);
  });
  for (auto &[field, gets] : arrays) {
    memref::AllocaOp array =
        copyArray(gets.front(), countElements(gets.front(), root, uniformity));
    for (GetOp get : gets) {
      OpBuilder builder(get);
      Value element = memref::LoadOp::create(builder, get.getLoc(), array,
                                             get.getElements().front());
      get.replaceAllUsesWith(element);
      get.erase();
    }
  }
}
