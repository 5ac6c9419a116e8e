// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Passes/BroadcastLoads.h"

#include "llvm/Analysis/LoopInfo.h"
#include "llvm/Analysis/MemorySSA.h"
#include "llvm/Analysis/MemorySSAUpdater.h"
#include "llvm/IR/IRBuilder.h"
#include "llvm/IR/InstIterator.h"
#include "llvm/IR/PatternMatch.h"
#include "llvm/Transforms/Utils/Local.h"

using namespace llvm;
using namespace llvm::PatternMatch;

namespace {

/// A number in memory.
struct LoadPlace {
  Value *base;
  int64_t offset; ///< in bytes
  Align alignment;

  bool operator==(const LoadPlace &other) const {
    return base == other.base && offset == other.offset;
  }
};

/// A number in memory that all lanes of a vector have, or its negation.
struct Broadcast {
  Instruction *splat = nullptr;
  SmallVector<LoadInst *, 2> loads; ///< of the ways that lead there
  LoadPlace place;
  bool isNegated = false;
};

class BroadcastLoads {
public:
  BroadcastLoads(Function &function, FunctionAnalysisManager &analyses)
      : loops(analyses.getResult<LoopAnalysis>(function)),
        memory(analyses.getResult<MemorySSAAnalysis>(function).getMSSA()),
        updater(&memory) {}
  /// Whether it is loaded again where it is broadcast.
  bool repeat(const Broadcast &broadcast);

private:
  bool isUnchanged(LoadInst *repeated, ArrayRef<LoadInst *> loads);

  LoopInfo &loops;
  MemorySSA &memory;
  MemorySSAUpdater updater;
};

} // namespace

/// Instructions broadcast 32 and 64 bits from memory without a shuffle.
static bool isBroadcastWidth(unsigned bits) { return bits == 32 || bits == 64; }

/// Where an element of what is loaded stands; of a scalar the first one.
static std::optional<LoadPlace> getPlace(LoadInst *load, unsigned element) {
  auto *vector = dyn_cast<FixedVectorType>(load->getType());
  if (!load->isSimple() || (vector && element >= vector->getNumElements()))
    return std::nullopt;
  const DataLayout &data = load->getDataLayout();
  Value *pointer = load->getPointerOperand();
  APInt offset(data.getIndexTypeSizeInBits(pointer->getType()), 0);
  Value *base = pointer->stripAndAccumulateConstantOffsets(
      data, offset, /*AllowNonInbounds=*/true);
  int64_t within =
      element * data.getTypeStoreSize(load->getType()->getScalarType());
  return LoadPlace{base, offset.getSExtValue() + within,
                   commonAlignment(load->getAlign(), within)};
}

/// The loads of a number, if it is the same on all ways.
static bool findLoads(Value *number, unsigned element, Broadcast &broadcast) {
  SmallVector<Value *> sources{number};
  if (auto *phi = dyn_cast<PHINode>(number))
    sources.assign(phi->op_begin(), phi->op_end());
  for (Value *source : sources) {
    auto *load = dyn_cast<LoadInst>(source);
    std::optional<LoadPlace> place;
    if (load)
      place = getPlace(load, element);
    if (!place || (!broadcast.loads.empty() && !(*place == broadcast.place)))
      return false;
    if (broadcast.loads.empty() || place->alignment < broadcast.place.alignment)
      broadcast.place = *place;
    broadcast.loads.push_back(load);
  }
  return true;
}

/// Whether a negation costs nothing: it is a part of fused operations.
static bool isFused(Instruction *splat) {
  return all_of(splat->users(), [](User *user) {
    return match(user, m_Intrinsic<Intrinsic::fma>());
  });
}

/// A number that was loaded, which a vector has in all lanes.
static std::optional<Broadcast> findBroadcast(Instruction &instruction) {
  auto *splat = dyn_cast<ShuffleVectorInst>(&instruction);
  if (!splat || !isBroadcastWidth(splat->getType()->getScalarSizeInBits()))
    return std::nullopt;
  ArrayRef<int> lanes = splat->getShuffleMask();
  if (lanes.front() < 0 || !all_equal(lanes))
    return std::nullopt;
  Broadcast broadcast;
  broadcast.splat = splat;
  uint64_t lane = lanes.front();
  Value *from = splat->getOperand(0), *inner;
  if (lane == 0 &&
      match(from, m_InsertElt(m_Value(), m_Value(inner), m_Zero())))
    from = inner;
  if (isFused(splat) && match(from, m_OneUse(m_FNeg(m_Value(inner))))) {
    from = inner;
    broadcast.isNegated = true;
  }
  if (match(from, m_ExtractElt(m_Value(inner), m_ConstantInt(lane))))
    from = inner;
  if (!findLoads(from, lane, broadcast))
    return std::nullopt;
  // Selection sees a whole load of the same block.
  if (!broadcast.isNegated && !from->getType()->isVectorTy() &&
      cast<Instruction>(from)->getParent() == splat->getParent() &&
      isa<LoadInst>(from))
    return std::nullopt;
  return broadcast;
}

/// Whether all read what the same write, or none, has left.
bool BroadcastLoads::isUnchanged(LoadInst *repeated,
                                 ArrayRef<LoadInst *> loads) {
  MemoryUseOrDef *next = nullptr;
  for (Instruction *at = repeated->getNextNode(); at && !next;
       at = at->getNextNode())
    next = memory.getMemoryAccess(at);
  auto *use = cast<MemoryUse>(
      next ? updater.createMemoryAccessBefore(repeated, nullptr, next)
           : updater.createMemoryAccessInBB(repeated, nullptr,
                                            repeated->getParent(),
                                            MemorySSA::BeforeTerminator));
  updater.insertUse(use);
  MemorySSAWalker *walker = memory.getWalker();
  MemoryAccess *written = walker->getClobberingMemoryAccess(use);
  return all_of(loads, [&](LoadInst *load) {
    return walker->getClobberingMemoryAccess(memory.getMemoryAccess(load)) ==
           written;
  });
}

bool BroadcastLoads::repeat(const Broadcast &broadcast) {
  Instruction *splat = broadcast.splat;
  for (LoadInst *load : broadcast.loads)
    if (loops.getLoopFor(splat->getParent()) !=
        loops.getLoopFor(load->getParent()))
      return false;
  IRBuilder<> builder(splat);
  LoadInst *load = builder.CreateAlignedLoad(
      splat->getType()->getScalarType(),
      builder.CreatePtrAdd(broadcast.place.base,
                           builder.getInt64(broadcast.place.offset)),
      broadcast.place.alignment);
  AAMDNodes access = broadcast.loads.front()->getAAMetadata();
  for (LoadInst *other : broadcast.loads)
    access = access.merge(other->getAAMetadata());
  load->setAAMetadata(access);
  if (!isUnchanged(load, broadcast.loads)) {
    updater.removeMemoryAccess(load);
    load->eraseFromParent();
    return false;
  }
  Value *all = builder.CreateVectorSplat(
      cast<VectorType>(splat->getType())->getElementCount(), load);
  if (broadcast.isNegated)
    all = builder.CreateFNeg(all);
  splat->replaceAllUsesWith(all);
  RecursivelyDeleteTriviallyDeadInstructions(splat, nullptr, &updater);
  return true;
}

bool piko::BroadcastLoadsPass::change(Function &function,
                                      FunctionAnalysisManager &analyses) {
  SmallVector<Broadcast> broadcasts;
  for (Instruction &instruction : instructions(function))
    if (std::optional<Broadcast> found = findBroadcast(instruction))
      broadcasts.push_back(*found);
  if (broadcasts.empty())
    return false;
  BroadcastLoads loads(function, analyses);
  bool isChanged = false;
  for (const Broadcast &broadcast : broadcasts)
    isChanged |= loads.repeat(broadcast);
  return isChanged;
}
