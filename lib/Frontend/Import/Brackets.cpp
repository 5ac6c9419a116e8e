//===- Brackets.cpp - What lies between two placeholders ------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The function that an update, a reduction or a scan is given has been inlined
// between a call that gives its arguments and one that takes its result. What
// is between them becomes the operation's region; what does not need to be
// there is moved before.
//
//===----------------------------------------------------------------------===//

#include "Import/Import.h"

#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/IR/Matchers.h"

using namespace piko;
using llvm::failure;
using llvm::LogicalResult;
using llvm::success;
using mlir::func::CallOp;

namespace {

enum class Kind { Update, Reduce, Scan };

class Bracket {
public:
  Bracket(CallOp begin, Kind kind)
      : begin(begin), kind(kind), block(begin->getBlock()) {}

  LogicalResult run() {
    if (failed(findEnd()))
      return failure();
    hoist();
    for (auto &op : between())
      if (failed(check(op)))
        return failure();
    if (kind == Kind::Update)
      makeUpdate();
    else
      return makeCombination();
    return success();
  }

private:
  llvm::iterator_range<mlir::Block::iterator> between() {
    return llvm::make_range(std::next(begin->getIterator()),
                            end->getIterator());
  }
  llvm::StringRef getName() const {
    return kind == Kind::Update ? "an update" : "the function of a reduction";
  }

  LogicalResult findEnd();
  LogicalResult check(mlir::Operation &op);
  bool isOutside(mlir::Operation &op);
  bool isUsedAfter(mlir::Value value);
  bool isHoistable(mlir::Operation &op);
  void hoist();
  void moveInto(mlir::Block *inner, mlir::Operation *op,
                llvm::ArrayRef<mlir::Value> leaving);
  void makeUpdate();
  LogicalResult makeCombination();

  CallOp begin, end;
  Kind kind;
  mlir::Block *block;
};

} // namespace

static std::optional<Kind> getKind(mlir::Operation *op) {
  auto call = mlir::dyn_cast<CallOp>(op);
  if (!call)
    return std::nullopt;
  if (call.getCallee().starts_with(updateBeginName))
    return Kind::Update;
  if (call.getCallee() == reduceBeginName)
    return Kind::Reduce;
  if (call.getCallee() == scanBeginName)
    return Kind::Scan;
  return std::nullopt;
}

llvm::StringRef piko::getBracketEnd(CallOp begin) {
  std::optional<Kind> kind = getKind(begin);
  if (!kind)
    return "";
  return *kind == Kind::Update ? updateEndName : combineEndName;
}

LogicalResult Bracket::findEnd() {
  llvm::StringRef name = getBracketEnd(begin);
  for (auto &op :
       llvm::make_range(std::next(begin->getIterator()), block->end())) {
    if (getKind(&op))
      return check(op);
    if (auto call = mlir::dyn_cast<CallOp>(op))
      if (call.getCallee() == name) {
        end = call;
        return success();
      }
  }
  return mlir::emitError(begin.getLoc(), "not supported in Piko: ")
         << getName() << " that never ends";
}

/// Reports what cannot be done in between.
LogicalResult Bracket::check(mlir::Operation &op) {
  mlir::WalkResult result = op.walk([&](mlir::Operation *inner) {
    llvm::StringRef what;
    if (std::optional<Kind> other = getKind(inner))
      what = *other == Kind::Update ? "an update" : "a reduction";
    else if (mlir::isa<UpdateOp>(inner))
      what = "an update";
    else if (mlir::isa<ReduceOp, ScanOp>(inner))
      what = "a reduction";
    else if (mlir::isa<ParallelLoopOpInterface>(inner))
      what = "a parallelFor";
    else if (mlir::isa<SyncOp, SortOp>(inner))
      what = "a barrier";
    else if (kind != Kind::Update && mlir::isa<EmitOp>(inner))
      what = "an emit";
    else if (kind != Kind::Update && mlir::isa<StoreOp, AtomicOp>(inner))
      what = "a change of the state";
    if (what.empty())
      return mlir::WalkResult::advance();
    mlir::emitError(inner->getLoc(), "not supported in Piko: ")
        << what << " inside " << getName();
    return mlir::WalkResult::interrupt();
  });
  return failure(result.wasInterrupted());
}

/// Whether an operation needs nothing that comes between begin and end.
bool Bracket::isOutside(mlir::Operation &op) {
  return llvm::all_of(op.getOperands(), [&](mlir::Value operand) {
    mlir::Operation *definition = operand.getDefiningOp();
    return !definition || definition->getBlock() != block ||
           definition->isBeforeInBlock(begin);
  });
}

bool Bracket::isUsedAfter(mlir::Value value) {
  return llvm::any_of(value.getUsers(), [&](mlir::Operation *user) {
    mlir::Operation *at = block->findAncestorOpInBlock(*user);
    return !at || (at != end && end->isBeforeInBlock(at));
  });
}

/// Whether an operation may run before what it is between. An update runs
/// once; a loop may run no iteration, and then nothing may be read at an index
/// that is not known to be inside.
bool Bracket::isHoistable(mlir::Operation &op) {
  if (op.getNumRegions() != 0 || !mlir::isMemoryEffectFree(&op))
    return false;
  // The records of fields are not known yet.
  auto get = mlir::dyn_cast<GetOp>(op);
  if (!get)
    return mlir::isSpeculatable(&op);
  return kind == Kind::Update ||
         llvm::all_of(get.getElements(), [](mlir::Value element) {
           return mlir::matchPattern(element, mlir::m_Constant());
         });
}

void Bracket::hoist() {
  for (auto &op : llvm::make_early_inc_range(between())) {
    // Constants and primitives are read without an effect, and may be read
    // again behind.
    bool isRead = kind != Kind::Update && mlir::isa<LoadOp, ListAtOp>(op) &&
                  llvm::any_of(op.getResults(), [&](mlir::Value value) {
                    return isUsedAfter(value);
                  });
    if ((isHoistable(op) || (op.getNumRegions() == 0 && isRead)) &&
        isOutside(op))
      op.moveBefore(begin);
  }
}

/// Moves what is between to the end of `inner`, the body of `op`, whose last
/// results are the values that leave.
void Bracket::moveInto(mlir::Block *inner, mlir::Operation *op,
                       llvm::ArrayRef<mlir::Value> leaving) {
  for (auto &moved : llvm::make_early_inc_range(between()))
    moved.moveBefore(inner, inner->end());
  mlir::OpBuilder builder = mlir::OpBuilder::atBlockEnd(inner);
  bool isUpdate = kind == Kind::Update;
  mlir::ValueRange numbers = end.getOperands();
  YieldOp::create(builder, end.getLoc(),
                  isUpdate ? numbers : mlir::ValueRange(),
                  isUpdate ? mlir::ValueRange(leaving) : numbers);
  for (auto [value, result] : llvm::zip(leaving, op->getResults()))
    mlir::Value(value).replaceUsesWithIf(result, [&](mlir::OpOperand &use) {
      return !op->isAncestor(use.getOwner()) && use.getOwner() != end;
    });
  for (auto [value, argument] :
       llvm::zip(begin.getResults(), inner->getArguments()))
    value.replaceAllUsesWith(argument);
}

void Bracket::makeUpdate() {
  llvm::SmallVector<mlir::Value> leaving;
  for (mlir::Operation &op : between())
    for (mlir::Value result : op.getResults())
      if (isUsedAfter(result))
        leaving.push_back(result);
  // What the update began with may be read after it.
  for (mlir::Value value : begin.getResults())
    if (isUsedAfter(value))
      leaving.push_back(value);

  mlir::OpBuilder builder(begin);
  auto update = UpdateOp::create(
      builder, begin.getLoc(), mlir::TypeRange(mlir::ValueRange(leaving)),
      mlir::FlatSymbolRefAttr::get(
          builder.getContext(),
          begin.getCallee().drop_front(updateBeginName.size())),
      begin.getOperands(), /*bin=*/mlir::Value(), /*tile=*/mlir::Value(),
      /*of=*/nullptr);
  mlir::Block *inner = builder.createBlock(&update.getBody());
  for (mlir::Value value : begin.getResults())
    inner->addArgument(value.getType(), begin.getLoc());
  moveInto(inner, update, leaving);
  end.erase();
  begin.erase();
}

LogicalResult Bracket::makeCombination() {
  bool leaves = llvm::any_of(begin.getResults(), [&](mlir::Value value) {
    return isUsedAfter(value);
  });
  for (mlir::Operation &op : between())
    for (mlir::Value result : op.getResults())
      leaves |= isUsedAfter(result);
  if (leaves)
    return mlir::emitError(begin.getLoc())
           << "expected the function of a reduction to do nothing but combine "
              "two values";
  mlir::OpBuilder builder(begin);
  mlir::Operation *op;
  mlir::ValueRange operands = begin.getOperands();
  if (kind == Kind::Reduce)
    op = ReduceOp::create(builder, begin.getLoc(), operands.getTypes(),
                          operands);
  else
    op = ScanOp::create(builder, begin.getLoc(),
                        operands.take_front(operands.size() / 2).getTypes(),
                        operands.take_front(operands.size() / 2),
                        operands.drop_front(operands.size() / 2));
  mlir::Block *inner = builder.createBlock(&op->getRegion(0));
  for (mlir::Value value : begin.getResults())
    inner->addArgument(value.getType(), begin.getLoc());
  if (mlir::Attribute name = begin->getAttr(cppNameAttr))
    op->setAttr(cppNameAttr, name);
  moveInto(inner, op, {});
  // Arrays of the function belong to it.
  op->walk([&](mlir::memref::StoreOp store) {
    auto array = store.getMemRef().getDefiningOp<mlir::memref::AllocaOp>();
    bool isOwn = array && llvm::all_of(array->getUsers(), [&](auto *user) {
                   return op->isAncestor(user);
                 });
    if (isOwn && !op->isAncestor(array))
      array->moveBefore(inner, inner->begin());
  });
  end.replaceAllUsesWith(op->getResults());
  end.erase();
  begin.erase();
  mlir::WalkResult result = op->walk([&](mlir::memref::StoreOp store) {
    if (op->isAncestor(store.getMemRef().getParentRegion()->getParentOp()))
      return mlir::WalkResult::advance();
    store.emitError("expected the function of a reduction to do nothing but "
                    "combine two values");
    return mlir::WalkResult::interrupt();
  });
  return failure(result.wasInterrupted());
}

LogicalResult piko::resolveBrackets(mlir::func::FuncOp function) {
  llvm::SmallVector<std::pair<CallOp, Kind>> begins;
  function.walk([&](CallOp call) {
    if (std::optional<Kind> kind = getKind(call))
      begins.push_back({call, *kind});
  });
  for (auto [begin, kind] : begins)
    if (failed(Bracket(begin, kind).run()))
      return failure();
  return success();
}
