// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Deferral/SplitUpdate.h"
#include "Support/StateAccess.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/IRMapping.h"
#include "mlir/Transforms/RegionUtils.h"

using namespace mlir;
using namespace piko;

namespace {

class UpdateSplitter {
public:
  explicit UpdateSplitter(UpdateOp update)
      : update(update), body(update.getBody().front()),
        yield(cast<YieldOp>(body.getTerminator())),
        written(getWrittenState(update)) {}

  /// Finds the numbers that can be overwritten later; false if there are none.
  bool findOverwritten();
  ArrayRef<Operation *> getWork() const { return work.getArrayRef(); }
  void split();

private:
  std::optional<Choice> findChoice(unsigned number);
  bool collect(Value value);
  bool isInUpdate(Operation *op) const { return update->isProperAncestor(op); }
  UpdateOp createTest();
  void overwrite(UpdateOp test);

  UpdateOp update;
  Block &body;
  YieldOp yield;
  llvm::DenseSet<StringAttr> written; ///< State that the update changes.
  std::optional<Choice> common;       ///< Its condition and outcome.
  SmallVector<std::pair<unsigned, Value>> overwritten;
  llvm::SetVector<Operation *> work; ///< Operands before their users.
};

} // namespace

std::optional<Choice> piko::getChoice(Value value, Value old) {
  if (auto select = value.getDefiningOp<arith::SelectOp>()) {
    if (select.getFalseValue() == old)
      return Choice{select.getCondition(), true, select.getTrueValue()};
    if (select.getTrueValue() == old)
      return Choice{select.getCondition(), false, select.getFalseValue()};
  }
  auto branch = value.getDefiningOp<scf::IfOp>();
  if (!branch)
    return std::nullopt;
  unsigned result = cast<OpResult>(value).getResultNumber();
  Value yes = branch.thenYield().getOperand(result),
        no = branch.elseYield().getOperand(result);
  if (no == old)
    return Choice{branch.getCondition(), true, yes};
  if (yes == old)
    return Choice{branch.getCondition(), false, no};
  return std::nullopt;
}

std::optional<Choice> UpdateSplitter::findChoice(unsigned number) {
  Value old = body.getArgument(number), value = yield.getPixel()[number];
  std::optional<Choice> choice = getChoice(value, old);
  // The old number is read nowhere else, and the choice only as the new one.
  if (!choice || !old.hasOneUse() || !value.hasOneUse())
    return std::nullopt;
  return choice;
}

/// Adds what a value is computed by, in the update and before; false if that
/// has to do with the pixel, or is no computation.
bool UpdateSplitter::collect(Value value) {
  Operation *op = value.getDefiningOp();
  if (!op)
    return cast<BlockArgument>(value).getOwner() != &body;
  if (work.contains(op))
    return true;
  bool isComputed =
      !op->walk([&](Operation *inner) {
           auto load = dyn_cast<LoadOp>(inner);
           bool isFree = load ? !written.contains(load.getStateAttr().getAttr())
                         : inner->getNumRegions() > 0
                             ? inner->getDialect() != update->getDialect()
                             : isMemoryEffectFree(inner);
           return isFree ? WalkResult::advance() : WalkResult::interrupt();
         }).wasInterrupted();
  if (!isComputed)
    return !isInUpdate(op);
  llvm::SetVector<Value> outer;
  getUsedValuesDefinedAbove(op->getRegions(), outer);
  outer.insert(op->operand_begin(), op->operand_end());
  for (Value used : outer)
    if (!collect(used))
      return false;
  work.insert(op);
  return true;
}

bool UpdateSplitter::findOverwritten() {
  for (unsigned i = 0; i < body.getNumArguments(); ++i) {
    std::optional<Choice> choice = findChoice(i);
    if (!choice || (common && (common->condition != choice->condition ||
                               common->outcome != choice->outcome)))
      continue;
    llvm::SetVector<Operation *> known = work;
    if (!collect(choice->value)) {
      work = std::move(known);
      continue;
    }
    common = choice;
    overwritten.emplace_back(i, choice->value);
  }
  return !overwritten.empty();
}

/// Lets a number stay, so that nothing of its choice reads it.
static void removeChoice(OpOperand &number, Value old) {
  auto choice = cast<OpResult>(number.get());
  number.set(old);
  auto branch = dyn_cast<scf::IfOp>(choice.getOwner());
  if (!branch)
    return choice.getOwner()->erase();
  OpBuilder builder(branch);
  Value none = arith::ConstantOp::create(builder, branch.getLoc(),
                                         builder.getZeroAttr(choice.getType()));
  for (scf::YieldOp end : {branch.thenYield(), branch.elseYield()})
    end->setOperand(choice.getResultNumber(), none);
}

/// The update without what is overwritten, and with the condition as a result
/// more.
UpdateOp UpdateSplitter::createTest() {
  OpBuilder builder(update);
  SmallVector<Type> types(update.getResultTypes());
  types.push_back(common->condition.getType());
  auto test =
      UpdateOp::create(builder, update.getLoc(), types, update.getImage(),
                       update.getCoordinates(), update.getBin(),
                       update.getTile(), update.getOfAttr());
  test->setDiscardableAttrs(update->getDiscardableAttrDictionary());
  IRMapping mapping;
  update.getBody().cloneInto(&test.getBody(), mapping);
  auto end = cast<YieldOp>(test.getBody().front().getTerminator());
  for (auto [number, value] : overwritten)
    removeChoice(end.getPixelMutable()[number],
                 test.getBody().getArgument(number));
  end.getResultsMutable().append(mapping.lookupOrDefault(common->condition));
  return test;
}

/// Overwrites the numbers under the test.
void UpdateSplitter::overwrite(UpdateOp test) {
  OpBuilder builder(update);
  Location loc = update.getLoc();
  Value condition = test.getResults().back();
  if (!common->outcome) {
    Value yes = arith::ConstantIntOp::create(builder, loc, 1, 1);
    condition = arith::XOrIOp::create(builder, loc, condition, yes);
  }
  auto branch = scf::IfOp::create(builder, loc, condition, /*withElse=*/false);
  builder.setInsertionPointToStart(branch.thenBlock());
  IRMapping mapping;
  for (Operation *op : work)
    if (isInUpdate(op))
      builder.clone(*op, mapping);
  auto overwrite = UpdateOp::create(
      builder, loc, TypeRange(), update.getImage(), update.getCoordinates(),
      update.getBin(), update.getTile(), update.getOfAttr());
  overwrite->setDiscardableAttrs(update->getDiscardableAttrDictionary());
  Block &pixel = overwrite.getBody().emplaceBlock();
  for (Value old : body.getArguments())
    pixel.addArgument(old.getType(), old.getLoc());
  SmallVector<Value> numbers(pixel.getArguments());
  for (auto [number, value] : overwritten)
    numbers[number] = mapping.lookupOrDefault(value);
  builder.setInsertionPointToStart(&pixel);
  YieldOp::create(builder, loc, numbers, ValueRange());
}

void UpdateSplitter::split() {
  UpdateOp test = createTest();
  overwrite(test);
  update->replaceAllUsesWith(test.getResults().drop_back());
  update.erase();
}

bool piko::splitUpdate(
    UpdateOp update,
    llvm::function_ref<bool(ArrayRef<Operation *>)> isWorthwhile) {
  UpdateSplitter splitter(update);
  if (!splitter.findOverwritten() || !isWorthwhile(splitter.getWork()))
    return false;
  splitter.split();
  return true;
}
