// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Which loops the threads of a block may share. The iterations of a parallel
// loop are independent but for the order of their emissions, which the log
// restores, and of their updates: these must be of one pixel for each
// iteration. The primitives of a bin are independent unless their stage updates
// pixels.

#include "PikoToGPU.h"

#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/IR/Matchers.h"
#include "llvm/ADT/StringMap.h"

using namespace mlir;
using namespace piko;

static bool isCast(Operation *op) {
  return isa<arith::IndexCastOp, arith::IndexCastUIOp, arith::TruncIOp,
             arith::ExtSIOp, arith::ExtUIOp>(op);
}

/// A number without casts and without what is added to it in each iteration
/// alike.
static Value getRoot(Value value, scf::ForOp loop) {
  auto isInvariant = [&](Value other) {
    return loop.isDefinedOutsideOfLoop(other) ||
           matchPattern(other, m_Constant());
  };
  while (Operation *op = value.getDefiningOp()) {
    if (isCast(op))
      value = op->getOperand(0);
    else if (isa<arith::AddIOp>(op) && isInvariant(op->getOperand(0)))
      value = op->getOperand(1);
    else if (isa<arith::AddIOp, arith::SubIOp>(op) &&
             isInvariant(op->getOperand(1)))
      value = op->getOperand(0);
    else
      break;
  }
  return value;
}

namespace {
/// A quotient or a remainder.
struct Division {
  bool isRemainder;
  Value divisor, result;
};
} // namespace

static std::optional<Division> matchDivision(Operation *op, Value of) {
  if (op->getNumResults() != 1 || op->getNumOperands() < 2 ||
      op->getOperand(0) != of)
    return std::nullopt;
  Value divisor = op->getOperand(1), result = op->getResult(0);
  if (isa<arith::RemUIOp, arith::RemSIOp>(op))
    return Division{true, divisor, result};
  if (isa<arith::DivUIOp, arith::DivSIOp>(op))
    return Division{false, divisor, result};
  if (auto divide = dyn_cast<DivideOp>(op))
    return Division{divide.getKind() == DivisionKind::RemainderS ||
                        divide.getKind() == DivisionKind::RemainderU,
                    divisor, result};
  return std::nullopt;
}

static bool isSame(Value a, Value b) {
  APInt x, y;
  return a == b || (matchPattern(a, m_ConstantInt(&x)) &&
                    matchPattern(b, m_ConstantInt(&y)) &&
                    x.getSExtValue() == y.getSExtValue());
}

/// Whether `roots` say what `value` is: it is one of them, or they say what its
/// quotient and its remainder are.
static bool determine(ArrayRef<Value> roots, Value value, int depth = 0) {
  if (llvm::is_contained(roots, value))
    return true;
  if (depth > 8)
    return false;
  SmallVector<Division> divisions;
  for (Operation *user : value.getUsers()) {
    if (isCast(user) && determine(roots, user->getResult(0), depth + 1))
      return true;
    if (auto division = matchDivision(user, value))
      divisions.push_back(*division);
  }
  for (const Division &quotient : divisions)
    for (const Division &remainder : divisions)
      if (!quotient.isRemainder && remainder.isRemainder &&
          isSame(quotient.divisor, remainder.divisor) &&
          determine(roots, quotient.result, depth + 1) &&
          determine(roots, remainder.result, depth + 1))
        return true;
  return false;
}

/// Whether no two iterations update a pixel.
static bool updatesOwnPixels(scf::ForOp loop) {
  llvm::StringMap<UpdateOp> known; // by image
  WalkResult result = loop.walk([&](UpdateOp update) -> WalkResult {
    auto [it, isFirst] = known.try_emplace(update.getImage(), update);
    if (!isFirst)
      return WalkResult(success(
          llvm::equal(it->second.getCoordinates(), update.getCoordinates())));
    SmallVector<Value> roots;
    for (Value coordinate : update.getCoordinates())
      roots.push_back(getRoot(coordinate, loop));
    return WalkResult(success(determine(roots, loop.getInductionVar())));
  });
  return !result.wasInterrupted();
}

/// Whether a loop holds some that iterations meet in.
static bool hasCutLoops(scf::ForOp loop) {
  return loop
      .walk([](Operation *op) {
        return isa<ScratchOp, DeferBeginOp>(op) ? WalkResult::interrupt()
                                                : WalkResult::advance();
      })
      .wasInterrupted();
}

void piko::findSharedLoops(KernelOp kernel) {
  bool isChecked =
      kernel
          .walk([](Operation *op) {
            return op->getName().getStringRef().starts_with("piko.check_")
                       ? WalkResult::interrupt()
                       : WalkResult::advance();
          })
          .wasInterrupted();
  if (isChecked)
    return; // what is checked is reported in the order of the reference
  kernel.walk<WalkOrder::PreOrder>([&](scf::ForOp loop) {
    if (!loop->hasAttr("piko.lanes") || loop.getNumResults() ||
        hasCutLoops(loop) || !updatesOwnPixels(loop))
      return WalkResult::advance();
    loop->setAttr(sharedAttrName, UnitAttr::get(loop.getContext()));
    return WalkResult::skip();
  });
}
