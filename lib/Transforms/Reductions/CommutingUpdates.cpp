// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Reductions/CommutingUpdates.h"

#include "Deferral/SplitUpdate.h"
#include "Piko/Transforms/Storage/PixelAccess.h"
#include "Reductions/PixelSelection.h"

#include "Piko/Dialect/Piko/IR/CppTypes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/IR/PatternMatch.h"
#include "llvm/ADT/MapVector.h"
#include "llvm/ADT/TypeSwitch.h"

using namespace mlir;
using namespace piko;

using Change = CommutingUpdate::Change;

/// The atomic operation that an operation on the old number is.
static std::optional<AtomicKind> getKind(Operation *op, Value old) {
  bool isLeft = op->getNumOperands() == 2 && op->getOperand(0) == old;
  using Kind = std::optional<AtomicKind>;
  return llvm::TypeSwitch<Operation *, Kind>(op)
      .Case([](arith::AddIOp) { return AtomicKind::Add; })
      .Case([&](arith::SubIOp) {
        return isLeft ? Kind(AtomicKind::Add) : std::nullopt;
      })
      .Case([](arith::AndIOp) { return AtomicKind::And; })
      .Case([](arith::OrIOp) { return AtomicKind::Or; })
      .Case([](arith::XOrIOp) { return AtomicKind::Xor; })
      .Case([](arith::MinSIOp) { return AtomicKind::MinS; })
      .Case([](arith::MaxSIOp) { return AtomicKind::MaxS; })
      .Case([](arith::MinUIOp) { return AtomicKind::MinU; })
      .Case([](arith::MaxUIOp) { return AtomicKind::MaxU; })
      .Default(std::nullopt);
}

/// How an update changes a number by an operation on it alone.
static std::optional<Change> getChange(UpdateOp update, unsigned number) {
  Block &body = update.getBody().front();
  auto yield = cast<YieldOp>(body.getTerminator());
  Value old = body.getArgument(number), value = yield.getPixel()[number];
  Change change{number, AtomicKind::Add, nullptr, Value(), Value()};
  std::optional<Choice> choice = getChoice(value, old);
  change.op = (choice ? choice->value : value).getDefiningOp();
  // In a branch the operation stands where the condition holds.
  if (choice && change.op && !value.getDefiningOp()->isAncestor(change.op)) {
    change.condition = choice->condition;
    change.outcome = choice->outcome;
  }
  if (!change.op || !update.getBody().isAncestor(change.op->getParentRegion()))
    return std::nullopt;
  std::optional<AtomicKind> kind = getKind(change.op, old);
  if (!kind || !llvm::is_contained(change.op->getOperands(), old) ||
      !(value.getType().isInteger(32) || value.getType().isInteger(64)))
    return std::nullopt;
  change.kind = *kind;
  change.value = change.op->getOperand(change.op->getOperand(0) == old);
  for (Value used : {change.value, change.condition})
    if (used && dependsOnPixel(used, update))
      return std::nullopt;
  return change;
}

static std::optional<CommutingUpdate> readUpdate(UpdateOp update) {
  if (!llvm::all_of(update.getResults(),
                    [](Value result) { return result.use_empty(); }))
    return std::nullopt;
  CommutingUpdate commuting{update, {}};
  Block &body = update.getBody().front();
  auto yield = cast<YieldOp>(body.getTerminator());
  for (auto [number, old] : llvm::enumerate(body.getArguments())) {
    if (yield.getPixel()[number] == old)
      continue;
    std::optional<Change> change = getChange(update, number);
    if (!change)
      return std::nullopt;
    commuting.changes.push_back(*change);
  }
  return commuting;
}

SmallVector<CommutingUpdate> piko::findCommutingUpdates(KernelOp kernel) {
  llvm::MapVector<StringAttr, SmallVector<CommutingUpdate>> images;
  llvm::DenseMap<std::pair<StringAttr, unsigned>, AtomicKind> kinds;
  llvm::DenseSet<StringAttr> others; // images that change in other ways, too
  kernel.walk([&](UpdateOp update) {
    StringAttr image = update.getImageAttr().getAttr();
    std::optional<CommutingUpdate> commuting = readUpdate(update);
    if (!commuting) {
      others.insert(image);
      return;
    }
    for (const Change &change : commuting->changes)
      if (kinds.try_emplace({image, change.number}, change.kind)
              .first->second != change.kind)
        others.insert(image);
    images[image].push_back(*commuting);
  });
  SmallVector<CommutingUpdate> found;
  for (auto &[image, updates] : images)
    if (!others.contains(image))
      llvm::append_range(found, updates);
  return found;
}

//===----------------------------------------------------------------------===//
// Rewriting
//===----------------------------------------------------------------------===//

static void createAtomic(OpBuilder &builder, PixelAccess &pixel,
                         const Change &change) {
  Value value = change.value;
  if (isa<arith::SubIOp>(change.op)) {
    Location loc = change.op->getLoc();
    Value zero = arith::ConstantOp::create(
        builder, loc, builder.getZeroAttr(value.getType()));
    value = arith::SubIOp::create(builder, loc, zero, value);
  }
  pixel.change(builder, change.number, change.kind, value);
}

/// Under a test of the pixel.
static void makeAtomic(CommutingUpdate &commuting) {
  UpdateOp update = commuting.update;
  IRRewriter builder(update);
  Location loc = update.getLoc();
  PixelAccess pixel(update);
  scf::IfOp test = pixel.createTest(builder, TypeRange());
  update->moveBefore(test.thenBlock()->getTerminator());
  Block &body = update.getBody().front();
  Operation *yield = body.getTerminator();
  for (const Change &change : commuting.changes) {
    if (!change.condition) {
      builder.setInsertionPoint(change.op);
      createAtomic(builder, pixel, change);
      continue;
    }
    builder.setInsertionPoint(yield);
    auto branch = scf::IfOp::create(builder, loc, change.condition,
                                    /*withElse=*/true);
    OpBuilder inside = change.outcome ? branch.getThenBodyBuilder()
                                      : branch.getElseBodyBuilder();
    createAtomic(inside, pixel, change);
  }
  // What is left of the old numbers is not used.
  builder.setInsertionPoint(update);
  SmallVector<Value> nothing;
  for (Value old : body.getArguments())
    nothing.push_back(arith::ConstantOp::create(
        builder, loc, builder.getZeroAttr(old.getType())));
  builder.eraseOp(yield);
  builder.inlineBlockBefore(&body, update, nothing);
  builder.eraseOp(update);
}

llvm::SetVector<StringAttr> piko::getImages(ArrayRef<CommutingUpdate> updates) {
  llvm::SetVector<StringAttr> images;
  for (const CommutingUpdate &update : updates)
    images.insert(UpdateOp(update.update).getImageAttr().getAttr());
  return images;
}

void piko::makeAtomic(StageOp stage, MutableArrayRef<CommutingUpdate> updates) {
  for (StringAttr image : getImages(updates))
    mlir::emitRemark(stage.getLoc(), "stage '")
        << getCppName(stage) << "' updates pixels of '" << image.getValue()
        << "' in any order, by atomic operations";
  for (CommutingUpdate &update : updates)
    ::makeAtomic(update);
}
