// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "LaneQuotients.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/IR/Matchers.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"
#include "llvm/ADT/SetVector.h"

using namespace mlir;
using namespace piko;

/// The quotient by what is the same in all turns that, where it is negative,
/// decides a test; or null.
static arith::DivFOp findQuotient(arith::CmpFOp test, bool skips,
                                  scf::ForOp root) {
  using P = arith::CmpFPredicate;
  P predicate = test.getPredicate();
  bool isDecided =
      skips ? llvm::is_contained({P::OLT, P::OLE, P::ULT, P::ULE}, predicate)
            : llvm::is_contained({P::OGT, P::OGE, P::UGT, P::UGE}, predicate);
  auto quotient = test.getLhs().getDefiningOp<arith::DivFOp>();
  bool isShared =
      quotient && quotient.getType().isF32() &&
      !root->isAncestor(quotient.getRhs().getParentBlock()->getParentOp());
  return isDecided && isShared && matchPattern(test.getRhs(), m_AnyZeroFloat())
             ? quotient
             : arith::DivFOp();
}

/// The quotients each of which decides alone, where it is negative, that a turn
/// does not go on.
static void findQuotients(Value condition, bool skips, scf::ForOp root,
                          llvm::SetVector<arith::DivFOp> &quotients) {
  Operation *op = condition.getDefiningOp();
  if (skips ? isa_and_nonnull<arith::OrIOp>(op)
            : isa_and_nonnull<arith::AndIOp>(op)) {
    findQuotients(op->getOperand(0), skips, root, quotients);
    findQuotients(op->getOperand(1), skips, root, quotients);
  } else if (auto test = dyn_cast_or_null<arith::CmpFOp>(op)) {
    if (arith::DivFOp quotient = findQuotient(test, skips, root))
      quotients.insert(quotient);
  }
}

/// Whether a quotient is surely negative: its dividend has the other sign than
/// the divisor, and is so much larger than nothing that it does not become 0.
static Value isSurelyNegative(OpBuilder &builder, arith::DivFOp quotient,
                              scf::ForOp root) {
  Location loc = quotient.getLoc();
  Value sign, least;
  {
    OpBuilder::InsertionGuard guard(builder);
    builder.setInsertionPoint(root);
    auto constant = [&](float value) -> Value {
      return arith::ConstantOp::create(builder, loc,
                                       builder.getF32FloatAttr(value));
    };
    constexpr float tiny = 0x1p-100F;
    Value divisor = quotient.getRhs();
    sign = math::CopySignOp::create(builder, loc, constant(1), divisor);
    least = arith::MulFOp::create(builder, loc,
                                  math::AbsFOp::create(builder, loc, divisor),
                                  constant(-tiny));
  }
  Value dividend = arith::MulFOp::create(builder, loc, quotient.getLhs(), sign);
  return arith::CmpFOp::create(builder, loc, arith::CmpFPredicate::OLT,
                               dividend, least);
}

/// Moves what only a block needs into it.
static void sinkInto(Block &block, Operation *end) {
  for (Operation *op = end->getPrevNode(), *before; op; op = before) {
    before = op->getPrevNode();
    bool isOnly = isPure(op) && !op->use_empty() &&
                  llvm::all_of(op->getUsers(), [&](Operation *user) {
                    return block.findAncestorOpInBlock(*user);
                  });
    if (isOnly)
      op->moveBefore(&block, block.begin());
  }
}

static void testDividends(scf::IfOp choice, scf::ForOp root) {
  bool skips = choice.getThenRegion().front().without_terminator().empty();
  bool hasElse = !choice.getElseRegion().empty() &&
                 !choice.getElseRegion().front().without_terminator().empty();
  llvm::SetVector<arith::DivFOp> quotients;
  if (choice.getNumResults() == 0 && skips == hasElse)
    findQuotients(choice.getCondition(), skips, root, quotients);
  if (quotients.empty())
    return;
  OpBuilder builder(choice);
  Location loc = choice.getLoc();
  Value isOut;
  for (arith::DivFOp quotient : quotients) {
    Value negative = isSurelyNegative(builder, quotient, root);
    isOut =
        isOut ? arith::OrIOp::create(builder, loc, isOut, negative) : negative;
  }
  Value yes = arith::ConstantIntOp::create(builder, loc, 1, 1);
  Value mayGoOn = arith::XOrIOp::create(builder, loc, isOut, yes);
  auto around = scf::IfOp::create(builder, loc, mayGoOn, /*withElse=*/false);
  choice->moveBefore(around.thenBlock(), around.thenBlock()->begin());
  sinkInto(*around.thenBlock(), around);
}

void piko::testDividends(scf::ForOp root) {
  SmallVector<scf::IfOp> choices;
  root.walk([&](scf::IfOp choice) { choices.push_back(choice); });
  for (scf::IfOp choice : choices)
    ::testDividends(choice, root);
}
