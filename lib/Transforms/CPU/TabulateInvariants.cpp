// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-tabulate-invariants: loop-invariant code motion of what differs only
// from iteration to iteration of an inner loop, by scalar expansion to an
// array.

#include "Piko/Dialect/Piko/IR/CodeBuilder.h"
#include "Piko/Dialect/Piko/IR/PikoApproximation.h"
#include "Piko/Transforms/Passes.h"
#include "Support/StateAccess.h"

#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/IR/IRMapping.h"
#include "mlir/IR/Matchers.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"
#include "llvm/ADT/SetVector.h"

namespace piko {
#define GEN_PASS_DEF_TABULATEINVARIANTS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct TabulateInvariantsPass
    : piko::impl::TabulateInvariantsBase<TabulateInvariantsPass> {
  void runOnOperation() override;
};

/// Looks at one inner loop.
class Tabulator {
public:
  Tabulator(scf::ForOp loop, const llvm::DenseSet<StringAttr> &written)
      : loop(loop), written(written) {}
  void run();

private:
  bool isOutside(Value value) const {
    Operation *at = value.getParentBlock()->getParentOp();
    return !outermost->isAncestor(at);
  }
  bool findOutermost();
  /// Whether a value is known before all loops, where it may be made
  /// again.
  bool isKnown(Value value);
  bool isFixed(LoadOp load);
  bool isOfIteration(LoadOp load);
  void findNumbers();
  bool isWorthwhile(Value number);
  Value clone(Value value, OpBuilder &builder, IRMapping &mapping);
  void writeTable(Value number, OpBuilder &builder, Value fits, Value count);

  scf::ForOp loop;
  Operation *outermost = nullptr; ///< the loop around all others
  const llvm::DenseSet<StringAttr> &written;
  llvm::SetVector<Value> numbers; ///< of an iteration alone
};

} // namespace

/// With fewer or more iterations the loop runs as it was.
static constexpr int64_t leastIterations = 32, mostIterations = 1024;

bool Tabulator::findOutermost() {
  for (Operation *at = loop->getParentOp(); at && !isa<scf::ForallOp>(at);
       at = at->getParentOp())
    if (isa<scf::ForOp, scf::WhileOp>(at))
      outermost = at;
  return outermost && outermost->getParentOfType<scf::ForallOp>();
}

bool Tabulator::isFixed(LoadOp load) {
  return !load.getTile() && !written.contains(load.getStateAttr().getAttr()) &&
         load.getElements().empty();
}

/// Whether an iteration reads the element of its own number.
bool Tabulator::isOfIteration(LoadOp load) {
  if (!load.getChecked() || load.getIndices().size() != 1)
    return false;
  Value index = load.getIndices().front();
  while (auto cast = index.getDefiningOp<arith::IndexCastOp>())
    index = cast.getIn();
  return index == loop.getInductionVar();
}

bool Tabulator::isKnown(Value value) {
  if (isOutside(value))
    return true;
  Operation *op = value.getDefiningOp();
  if (!op || op->getNumRegions() != 0)
    return false;
  auto load = dyn_cast<LoadOp>(op);
  bool isFree =
      load ? load->getNumOperands() == 0 && isFixed(load) : isPure(op);
  return isFree && llvm::all_of(op->getOperands(), [&](Value operand) {
           return isKnown(operand);
         });
}

/// Numbers that are computed of the iteration's own number alone. What only a
/// side of a condition reads is not: its place may be known to exist there
/// only.
void Tabulator::findNumbers() {
  auto isPart = [&](Value value) {
    return value == loop.getInductionVar() || numbers.contains(value) ||
           isKnown(value);
  };
  loop.walk<WalkOrder::PreOrder>([&](Operation *op) {
    if (op != loop && isa<scf::ForOp, scf::WhileOp>(op))
      return WalkResult::skip();
    auto load = dyn_cast<LoadOp>(op);
    bool isScalar = op->getNumResults() == 1 && op->getNumRegions() == 0 &&
                    op->getResult(0).getType().isIntOrIndexOrFloat();
    bool isFree = load ? isFixed(load) && isOfIteration(load)
                       : isPure(op) && !isa<arith::ConstantOp>(op);
    if (isScalar && isFree && llvm::all_of(op->getOperands(), isPart))
      numbers.insert(op->getResult(0));
    return WalkResult::advance();
  });
}

/// Whether a number takes a root or a division, and something else than other
/// numbers needs it.
bool Tabulator::isWorthwhile(Value number) {
  auto isUsed = [&](Operation *user) {
    return user->getNumResults() != 1 || !numbers.contains(user->getResult(0));
  };
  if (!number.getType().isFloat() || llvm::none_of(number.getUsers(), isUsed))
    return false;
  SmallVector<Value> work{number};
  while (!work.empty()) {
    Value value = work.pop_back_val();
    Operation *op = value.getDefiningOp();
    if (!numbers.contains(value))
      continue;
    if (isa<arith::DivFOp, math::SqrtOp>(op) || isApproximation(op))
      return true;
    llvm::append_range(work, op->getOperands());
  }
  return false;
}

Value Tabulator::clone(Value value, OpBuilder &builder, IRMapping &mapping) {
  if (Value known = mapping.lookupOrNull(value))
    return known;
  if (isOutside(value))
    return value;
  Operation *op = value.getDefiningOp();
  for (Value operand : op->getOperands())
    mapping.map(operand, clone(operand, builder, mapping));
  return builder.clone(*op, mapping)->getResult(0);
}

void Tabulator::writeTable(Value number, OpBuilder &builder, Value fits,
                           Value count) {
  Location loc = number.getLoc();
  CodeBuilder at(builder, loc);
  Value table = memref::AllocaOp::create(
      builder, loc, MemRefType::get({mostIterations}, number.getType()));
  at.forEach(at.index(0), count, at.index(1), [&](Value iteration) {
    IRMapping mapping;
    mapping.map(loop.getInductionVar(), iteration);
    at.store(clone(number, builder, mapping), table, iteration);
  });
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointAfterValue(number);
  auto choice = scf::IfOp::create(builder, loc, number.getType(), fits,
                                  /*withElse=*/true);
  builder.setInsertionPointToStart(choice.thenBlock());
  scf::YieldOp::create(builder, loc, at.load(table, loop.getInductionVar()));
  builder.setInsertionPointToStart(choice.elseBlock());
  IRMapping mapping;
  for (Value other : numbers)
    if (other.getDefiningOp<LoadOp>()) // as it is in front
      mapping.map(other, other);
  mapping.map(loop.getInductionVar(), loop.getInductionVar());
  Operation *again = builder.clone(*number.getDefiningOp(), mapping);
  scf::YieldOp::create(builder, loc, again->getResult(0));
  number.replaceUsesWithIf(choice.getResult(0), [&](OpOperand &use) {
    Operation *user = use.getOwner();
    return user != again && (user->getNumResults() != 1 ||
                             !numbers.contains(user->getResult(0)));
  });
}

void Tabulator::run() {
  std::optional<APInt> iterations = loop.getStaticTripCount();
  constexpr int64_t few = 16; // LLVM unrolls it
  if (!findOutermost() || !matchPattern(loop.getLowerBound(), m_Zero()) ||
      !matchPattern(loop.getStep(), m_One()) ||
      !loop.getInductionVar().getType().isIndex() ||
      (iterations && iterations->sle(few)) || !isKnown(loop.getUpperBound()))
    return;
  findNumbers();
  SmallVector<Value> found = llvm::filter_to_vector(
      numbers, [&](Value number) { return isWorthwhile(number); });
  if (found.empty())
    return;
  OpBuilder builder(outermost);
  CodeBuilder at(builder, loop.getLoc());
  IRMapping mapping;
  Value upper = clone(loop.getUpperBound(), builder, mapping);
  // What a test around the loop proves of its reads is not known there.
  llvm::SetVector<Attribute> states;
  for (Value number : numbers)
    if (auto load = number.getDefiningOp<LoadOp>())
      states.insert(load.getStateAttr());
  Value fits =
      at.both(at.compare(CodeBuilder::P::sge, upper, at.index(leastIterations)),
              at.compare(CodeBuilder::P::sle, upper, at.index(mostIterations)));
  for (Attribute state : states) {
    Value extent =
        ExtentOp::create(builder, at.loc, cast<FlatSymbolRefAttr>(state),
                         builder.getI64IntegerAttr(0));
    fits = at.both(fits, at.compare(CodeBuilder::P::sle, upper, extent));
  }
  Value count = at.select(fits, upper, at.index(0));
  for (Value number : found)
    writeTable(number, builder, fits, count);
}

void TabulateInvariantsPass::runOnOperation() {
  for (auto kernel : getOperation().getOps<KernelOp>()) {
    llvm::DenseSet<StringAttr> written = getWrittenState(kernel);
    SmallVector<scf::ForOp> loops;
    kernel.walk([&](scf::ForOp loop) { loops.push_back(loop); });
    for (scf::ForOp loop : loops)
      Tabulator(loop, written).run();
  }
}
