// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Splits the work on a primitive: an operation is left to the pixels if it has
// an effect, knows the thread or an array, is in a loop with such an operation,
// or needs the result of one; all else is the setup. Where one is in an scf.if
// that is the same for all threads, both have that scf.if.

#include "PikoToGPU/Mapping/SetupSplit.h"

#include "PikoToGPU/PikoToGPU.h"

#include "mlir/Interfaces/SideEffectInterfaces.h"

using namespace mlir;
using namespace piko;

SetupSplit::SetupSplit(Operation *items, Extent extent, ArrayRef<Value> own,
                       ArrayRef<Block *> rare)
    : items(items), extent(extent), rare(rare.begin(), rare.end()),
      own(own.begin(), own.end()) {
  findPixelWork();
  findShared();
}

//===----------------------------------------------------------------------===//
// What is left to the pixels
//===----------------------------------------------------------------------===//

/// Whether an operand is left to the pixels.
bool SetupSplit::needsPixels(Operation *op) const {
  return llvm::any_of(op->getOperands(), [&](Value operand) {
    Operation *from = operand.getDefiningOp();
    return isa<MemRefType>(operand.getType()) || own.contains(operand) ||
           (from && pixels.contains(from));
  });
}

bool SetupSplit::mustKeep(Operation *op) const {
  if (extent == Extent::Fields && !isa<GetOp, ItemOp>(op))
    return true;
  if (auto access = dyn_cast<StateAccessOpInterface>(op))
    if (access.getAccessKinds() != StateAccess::reads)
      return true;
  if (!hasEffectsOfRegions(op) && !isMemoryEffectFree(op) &&
      !hasSingleEffect<MemoryEffects::Read>(op))
    return true;
  return needsPixels(op);
}

/// Whether all threads take the same way through an scf.if that has work for
/// pixels in it.
bool SetupSplit::isCommonIf(Operation *op) const {
  return op == items ||
         (isa<scf::IfOp>(op) && !mustKeep(op) && isCommonIf(op->getParentOp()));
}

/// Whether something inside is left to the pixels, or rare.
bool SetupSplit::hasWorkForPixels(Operation *op) const {
  return llvm::any_of(op->getRegions(), [&](Region &region) {
    return llvm::any_of(region, [&](Block &block) {
      return rare.contains(&block) ||
             llvm::any_of(block, [&](Operation &inner) {
               return pixels.contains(&inner);
             });
    });
  });
}

void SetupSplit::walk(llvm::function_ref<void(Operation *)> visit) const {
  items->getRegion(0).walk([&](Operation *op) {
    for (Operation *at = op; at != items; at = at->getParentOp())
      if (rare.contains(at->getBlock()))
        return;
    visit(op);
  });
}

void SetupSplit::findPixelWork() {
  // Again and again, because in a loop a use comes first.
  for (bool changed = true; changed;) {
    changed = false;
    walk([&](Operation *op) {
      Operation *parent = op->getParentOp();
      bool isInLoop =
          parent != items && pixels.contains(parent) && !isCommonIf(parent);
      bool isLeft;
      if (op->hasTrait<OpTrait::IsTerminator>()) {
        // What it hands on is a result of the operation around it.
        isLeft = parent != items && needsPixels(op);
        op = parent;
      } else {
        isLeft = mustKeep(op) || isInLoop || hasWorkForPixels(op);
      }
      if (!isLeft || pixels.contains(op))
        return;
      changed = true;
      pixels.insert(op);
      for (Region &region : op->getRegions())
        for (Block &block : region)
          own.insert(block.args_begin(), block.args_end());
    });
  }
}

//===----------------------------------------------------------------------===//
// What they need of the setup
//===----------------------------------------------------------------------===//

bool SetupSplit::isInSetup(Value value) const {
  Operation *op = value.getDefiningOp();
  return op && items->isProperAncestor(op) && !pixels.contains(op);
}

void SetupSplit::findShared() {
  SmallVector<Value> todo;
  walk([&](Operation *op) {
    bool ends = op->hasTrait<OpTrait::IsTerminator>();
    if (pixels.contains(ends ? op->getParentOp() : op))
      llvm::append_range(todo, op->getOperands());
  });
  while (!todo.empty()) {
    Value value = todo.pop_back_val();
    if (!isInSetup(value))
      continue;
    Operation *op = value.getDefiningOp();
    bool isNumber = value.getType().isIntOrIndexOrFloat();
    if (!isNumber || op->hasTrait<OpTrait::ConstantLike>() ||
        isa<arith::IndexCastOp, arith::IndexCastUIOp, arith::ExtSIOp,
            arith::ExtUIOp, arith::TruncIOp>(op)) {
      if (both.insert(op).second)
        llvm::append_range(todo, op->getOperands());
    } else {
      shared.insert(value);
    }
  }
  computeAgain();
}

/// One operation on what is there anyway is no more than a load.
void SetupSplit::computeAgain() {
  auto isConstant = [](Value value) {
    return value.getDefiningOp() &&
           value.getDefiningOp()->hasTrait<OpTrait::ConstantLike>();
  };
  auto isThere = [&](Value value) {
    return !isInSetup(value) || isConstant(value) || shared.contains(value) ||
           both.contains(value.getDefiningOp());
  };
  for (Value value : llvm::to_vector(shared)) {
    Operation *op = value.getDefiningOp();
    if (op->getNumRegions() || !isMemoryEffectFree(op) ||
        isa<GetOp, arith::RemFOp>(op) || op->getNumResults() != 1 ||
        !llvm::all_of(op->getOperands(), isThere))
      continue;
    both.insert(op);
    shared.remove(value);
    for (Value operand : op->getOperands())
      if (isInSetup(operand) && isConstant(operand))
        both.insert(operand.getDefiningOp());
  }
}

int64_t SetupSplit::countBytes() const {
  int64_t bytes = 0;
  for (Value value : shared) {
    Type type = getStorage(value.getType());
    bytes +=
        type.isIndex() ? 8 : llvm::divideCeil(type.getIntOrFloatBitWidth(), 8);
  }
  return bytes;
}

//===----------------------------------------------------------------------===//
// Groups of primitives
//===----------------------------------------------------------------------===//

/// Whether setups find where the pixels of the nest are.
static bool isNestInSetup(const SetupSplit &split, PixelNest &nest) {
  for (auto [block, next] : nest.levels) {
    if (next == nest.anchor)
      break;
    if (!isa<scf::IfOp>(next) || split.mustKeep(next))
      return false;
  }
  auto isKnown = [&](Value value) {
    Operation *made = value ? value.getDefiningOp() : nullptr;
    return !made || !split.isForPixels(made);
  };
  for (int64_t dim = 0, e = nest.getRank(); dim < e; ++dim) {
    const PixelLoop *loop = nest.getLoop(dim);
    if (!isKnown(nest.getFirst(dim)) || (loop && !isKnown(loop->getEnd())))
      return false;
  }
  return true;
}

PixelGroup::PixelGroup(int64_t threads, StageOp stage)
    : threads(threads), size(std::min<int64_t>(threads, 64)),
      words(llvm::divideCeil(size, 32)) {
  for (int64_t extent : stage.getBins())
    pixels *= extent;
}

/// Of a block's shared memory: with more, a multiprocessor has few of its
/// threads at work. A bin that has so many pixels for a thread has primitives
/// for which masks cost more than threads that idle: a large triangle has many,
/// and its test is cheap beside an atomic.
static constexpr int64_t maxBytesOfThread = 384;

bool PixelGroup::fits(int64_t setupBytes) const {
  int64_t bytes = threads * setupBytes + 8 * PIKOIR_FLUSH_WORDS + 12 +
                  8 * size + 4 * words * pixels +
                  llvm::divideCeil(pixels, 32) * 4 + 2 * pixels;
  int64_t most = std::min(
      maxSharedBytes, maxBytesOfThread * std::max<int64_t>(threads, warpSize));
  return canCount() && bytes <= most;
}

std::optional<Obstacle> piko::findObstacleToGroups(Operation *items,
                                                   const SetupSplit &split,
                                                   PixelNest &nest,
                                                   const PixelGroup &group) {
  if (!group.canCount())
    return Obstacle{items->getLoc(), "a bin has too many pixels for masks"};
  if (!isNestInSetup(split, nest))
    return Obstacle{items->getLoc(),
                    "where its pixels are depends on an array"};
  return std::nullopt;
}
