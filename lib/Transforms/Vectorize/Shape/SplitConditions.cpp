// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
//   if (c) { A; while (flag) B; C } else D
//     =>  flag = false; if (c) A else D; while (flag) B; if (c) C

#include "Vectorize/Shape/SplitConditions.h"

#include "Piko/Dialect/Piko/IR/CodeBuilder.h"
#include "Vectorize/Shape/RotateLoops.h"

#include "llvm/ADT/SetVector.h"

using namespace mlir;
using namespace piko;

using Values = SmallVector<Value>;

namespace {

/// Splits a condition at a loop that tests a flag, in one of its sides.
class ConditionSplit {
public:
  ConditionSplit(scf::IfOp choice, scf::WhileOp loop)
      : choice(choice), loop(loop), builder(choice), loc(choice.getLoc()),
        side(loop->getBlock()), isFirst(side == choice.thenBlock()),
        other(isFirst ? choice.elseBlock() : choice.thenBlock()) {}
  void write();

private:
  void findLive();
  bool isFromOther(Value value) const {
    return other && other->getParent()->isAncestor(value.getParentRegion());
  }
  scf::IfOp writeBefore();
  scf::IfOp createIf(TypeRange types);
  Block *getSide(scf::IfOp made) const {
    return isFirst ? made.thenBlock() : made.elseBlock();
  }
  Block *getOther(scf::IfOp made) const {
    return isFirst ? made.elseBlock() : made.thenBlock();
  }

  scf::IfOp choice;
  scf::WhileOp loop;
  OpBuilder builder;
  Location loc;
  Block *side;
  bool isFirst;
  Block *other; ///< or null
  /// What is computed before the loop for it and for what is after it, and what
  /// the other side yields of its own.
  llvm::SetVector<Value> live, passed;
};

} // namespace

void ConditionSplit::findLive() {
  auto add = [&](Value value) {
    Operation *from = value.getDefiningOp();
    if (from && from->getBlock() == side && from->isBeforeInBlock(loop))
      live.insert(value);
  };
  auto addAll = [&](Operation *op) {
    op->walk([&](Operation *in) {
      if (in != loop)
        llvm::for_each(in->getOperands(), add);
    });
  };
  for (Operation *op = loop; op; op = op->getNextNode())
    addAll(op);
  if (other)
    for (Value value : other->getTerminator()->getOperands())
      if (isFromOther(value))
        passed.insert(value);
}

scf::IfOp ConditionSplit::createIf(TypeRange types) {
  auto made = scf::IfOp::create(builder, loc, types, choice.getCondition(),
                                /*withElse=*/true);
  for (Region *region : {&made.getThenRegion(), &made.getElseRegion()})
    if (!region->front().empty())
      region->front().getTerminator()->erase();
  made->setDiscardableAttrs(choice->getDiscardableAttrDictionary());
  return made;
}

/// What is before the loop, or the other side, which has no loop.
scf::IfOp ConditionSplit::writeBefore() {
  Values inits = llvm::to_vector(loop.getInits());
  SmallVector<Type> types(ValueRange(inits).getTypes());
  for (const auto &values : {live, passed})
    llvm::append_range(types, ValueRange(values.getArrayRef()).getTypes());
  scf::IfOp made = createIf(types);
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToEnd(getSide(made));
  getSide(made)->getOperations().splice(getSide(made)->end(),
                                        side->getOperations(), side->begin(),
                                        loop->getIterator());
  Values yielded = inits;
  llvm::append_range(yielded, live);
  llvm::append_range(
      yielded,
      createPoison(builder, loc, ValueRange(passed.getArrayRef()).getTypes()));
  scf::YieldOp::create(builder, loc, yielded);

  builder.setInsertionPointToEnd(getOther(made));
  Values nothing{CodeBuilder(builder, loc).boolean(false)};
  llvm::append_range(
      nothing,
      createPoison(builder, loc,
                   ArrayRef(types).slice(1, inits.size() - 1 + live.size())));
  if (other) {
    OpBuilder::InsertPoint end = builder.saveInsertionPoint();
    builder.setInsertionPointToStart(getOther(made));
    moveBody(*other, builder);
    builder.restoreInsertionPoint(end);
  }
  llvm::append_range(nothing, passed);
  scf::YieldOp::create(builder, loc, nothing);
  return made;
}

void ConditionSplit::write() {
  findLive();
  Values ofOther =
      other ? llvm::to_vector(other->getTerminator()->getOperands()) : Values();
  scf::IfOp before = writeBefore();
  ValueRange made = before.getResults();
  size_t count = loop.getInits().size();
  loop->moveBefore(choice);
  loop.getInitsMutable().assign(made.take_front(count));
  auto replace = [&](const llvm::SetVector<Value> &from, ValueRange to) {
    for (auto [value, result] : llvm::zip_equal(from.getArrayRef(), to))
      Value(value).replaceUsesWithIf(result, [&](OpOperand &use) {
        return !before->isAncestor(use.getOwner());
      });
  };
  replace(live, made.slice(count, live.size()));
  for (Value &value : ofOther)
    if (passed.contains(value))
      value = made[count + live.size() +
                   size_t(std::distance(passed.begin(),
                                        llvm::find(passed, value)))];

  Values ofSide = llvm::to_vector(side->getTerminator()->getOperands());
  if (side->without_terminator().empty() && ofSide.empty()) {
    choice.erase();
    return;
  }
  builder.setInsertionPoint(choice);
  scf::IfOp after = createIf(choice.getResultTypes());
  builder.setInsertionPointToEnd(getSide(after));
  moveBody(*side, builder);
  scf::YieldOp::create(builder, loc, ofSide);
  builder.setInsertionPointToEnd(getOther(after));
  scf::YieldOp::create(builder, loc, ofOther);
  choice.replaceAllUsesWith(after);
  choice.erase();
}

void piko::split(scf::WhileOp loop, Block *body) {
  while (loop->getBlock() != body)
    ConditionSplit(cast<scf::IfOp>(loop->getParentOp()), loop).write();
}
