// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-spill-to-block: numbers that are alive over an innermost loop, and that
// it needs under a condition or not at all, are in shared memory. For each
// such loop of a kernel
//   1. count the registers of what is alive over it: if there are few, all
//      stays as it is;
//   2. a number that each of its iterations needs stays in a register;
//   3. any other is stored where it is known, at a place of the thread's, and
//      loaded where it is used inside of the loop, or after it. The load is
//      not to be moved: before the loop it would take a register again.
// So ptxas has nothing to spill to the thread's own memory, where a spill is
// several times as slow, and the choice is by how often a number is needed.

#include "Piko/Analysis/TargetModel.h"
#include "Piko/Conversion/Passes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/GPU/IR/GPUDialect.h"
#include "mlir/Dialect/LLVMIR/NVVMDialect.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/Interfaces/LoopLikeInterface.h"
#include "llvm/ADT/MapVector.h"
#include "llvm/ADT/SetVector.h"

namespace piko {
#define GEN_PASS_DEF_SPILLTOBLOCK
#include "Piko/Conversion/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct SpillToBlockPass : piko::impl::SpillToBlockBase<SpillToBlockPass> {
  using SpillToBlockBase::SpillToBlockBase;
  void runOnOperation() override;
};

/// Spills what is alive over one innermost loop.
class Spiller {
public:
  Spiller(gpu::GPUFuncOp kernel, LoopLikeOpInterface loop, int64_t threads)
      : kernel(kernel), loop(loop), threads(threads) {}

  /// The registers of 32 bits of what is alive over the loop.
  int64_t countRegisters();
  /// If there are more than that, spills as far as there are bytes for a
  /// thread.
  void run(int64_t mostRegisters, int64_t &bytesLeft);

private:
  void repeatCasts();
  void collect();
  bool isSpillable(Value value) const;
  bool isHot(Value value) const;
  bool isAfter(OpOperand &use, Operation *around) const;
  Operation *findAround(Value value) const;
  void spill(Value value);

  gpu::GPUFuncOp kernel;
  LoopLikeOpInterface loop;
  int64_t threads;
  llvm::SetVector<Value> alive;
};

} // namespace

static int64_t getRegisters(Type type) {
  if (type.isInteger(1) || !type.isIntOrIndexOrFloat())
    return 0;
  return type.isIndex() || type.getIntOrFloatBitWidth() > 32 ? 2 : 1;
}

/// A number that is as cheap to find again as to keep.
static bool isCast(Operation *op) {
  return op && isa<arith::IndexCastOp, arith::IndexCastUIOp, arith::ExtSIOp,
                   arith::ExtUIOp, arith::TruncIOp>(op);
}

/// In the block where a value is known: the operation that holds the loop.
Operation *Spiller::findAround(Value value) const {
  Operation *around = value.getParentBlock()->findAncestorOpInBlock(*loop);
  Operation *made = value.getDefiningOp();
  if (!around || around == made || (made && around->isBeforeInBlock(made)))
    return nullptr;
  return around;
}

/// Whether the number has to outlive the loop, or some of its iterations, to be
/// used there.
bool Spiller::isAfter(OpOperand &use, Operation *around) const {
  Operation *user = around->getBlock()->findAncestorOpInBlock(*use.getOwner());
  if (user == use.getOwner() && user == around)
    return false; // what a loop begins with
  return user == around || around->isBeforeInBlock(user);
}

/// Whether each iteration of the loop uses it.
bool Spiller::isHot(Value value) const {
  return llvm::any_of(value.getUses(), [&](OpOperand &use) {
    Operation *user = use.getOwner();
    if (!loop->isProperAncestor(user))
      return false;
    for (Operation *op = user->getParentOp(); op != loop;
         op = op->getParentOp())
      if (isa<scf::IfOp, scf::IndexSwitchOp>(op))
        return false;
    return true;
  });
}

/// Whether a value has a register of its own for longer than its uses.
bool Spiller::isSpillable(Value value) const {
  Operation *made = value.getDefiningOp();
  if (getRegisters(value.getType()) == 0)
    return false;
  if (made)
    return !made->hasTrait<OpTrait::ConstantLike>() && made->getNumOperands();
  return !isa<gpu::GPUFuncOp>(value.getParentBlock()->getParentOp());
}

/// Casts are made where they are used: else a number and its cast would both be
/// kept.
void Spiller::repeatCasts() {
  SmallVector<Operation *> casts;
  kernel.walk([&](Operation *op) {
    if (isCast(op) && findAround(op->getResult(0)))
      casts.push_back(op);
  });
  for (Operation *cast : llvm::reverse(casts)) {
    Operation *around = findAround(cast->getResult(0));
    for (OpOperand &use : llvm::make_early_inc_range(cast->getUses()))
      if (isAfter(use, around) && !isHot(cast->getResult(0))) {
        OpBuilder builder(use.getOwner());
        use.set(builder.clone(*cast)->getResult(0));
      }
    if (cast->use_empty())
      cast->erase();
  }
}

void Spiller::collect() {
  alive.clear();
  auto visit = [&](Value value) {
    if (!isSpillable(value))
      return;
    if (Operation *around = findAround(value);
        around && llvm::any_of(value.getUses(), [&](OpOperand &use) {
          return isAfter(use, around);
        }))
      alive.insert(value);
  };
  for (Operation *op = loop->getParentOp(); op != kernel->getParentOp();
       op = op->getParentOp())
    for (Region &region : op->getRegions())
      for (Block &block : region) {
        for (Value argument : block.getArguments())
          visit(argument);
        for (Operation &inner : block)
          for (Value result : inner.getResults())
            visit(result);
      }
}

int64_t Spiller::countRegisters() {
  collect();
  int64_t count = 0;
  for (Value value : alive)
    count += getRegisters(value.getType());
  for (Value argument : loop->getRegions().back().getArguments())
    count += getRegisters(argument.getType());
  return count;
}

/// Uses of one block that no loop parts share a load.
void Spiller::spill(Value value) {
  Location loc = value.getLoc();
  Operation *around = findAround(value);
  OpBuilder builder(kernel.getContext());
  builder.setInsertionPointAfterValue(value);
  Type type = value.getType();
  auto space = gpu::AddressSpaceAttr::get(
      kernel.getContext(), gpu::GPUDialect::getWorkgroupAddressSpace());
  Value memory = kernel.addWorkgroupAttribution(
      MemRefType::get(threads, type, MemRefLayoutAttrInterface(), space), loc);
  llvm::MapVector<Block *, SmallVector<OpOperand *>> blocks;
  for (OpOperand &use : value.getUses())
    if (isAfter(use, around))
      blocks[use.getOwner()->getBlock()].push_back(&use);
  auto thread = [](OpBuilder &at, Location loc) -> Value {
    return gpu::ThreadIdOp::create(at, loc, gpu::Dimension::x);
  };
  memref::StoreOp::create(builder, loc, value, memory, thread(builder, loc));
  for (auto &[block, uses] : blocks) {
    llvm::sort(uses, [](OpOperand *a, OpOperand *b) {
      return a->getOwner() != b->getOwner() &&
             a->getOwner()->isBeforeInBlock(b->getOwner());
    });
    Operation *last = nullptr;
    Value loaded;
    for (OpOperand *use : uses) {
      Operation *user = use->getOwner();
      bool isParted = !last;
      for (Operation *op = last; op && op != user; op = op->getNextNode())
        isParted |= op->getNumRegions() != 0;
      if (isParted) {
        OpBuilder at(user);
        auto load = memref::LoadOp::create(at, loc, memory, thread(at, loc));
        load.setNontemporal(true);
        loaded = load;
      }
      use->set(loaded);
      last = user;
    }
  }
}

void Spiller::run(int64_t mostRegisters, int64_t &bytesLeft) {
  if (countRegisters() <= mostRegisters)
    return;
  repeatCasts();
  collect();
  for (Value value : alive) {
    int64_t bytes = 4 * getRegisters(value.getType());
    if (isHot(value) || bytes > bytesLeft)
      continue;
    spill(value);
    bytesLeft -= bytes;
  }
}

/// Whether registers are bounded for it: it calls a function, or loads numbers
/// again that are in shared memory.
static bool isBounded(gpu::GPUFuncOp kernel) {
  return kernel->hasAttr(NVVM::NVVMDialect::getMaxnregAttrName()) ||
         kernel
             .walk([](memref::LoadOp load) {
               return load.getNontemporal() ? WalkResult::interrupt()
                                            : WalkResult::advance();
             })
             .wasInterrupted();
}

static int64_t getBlockBytes(gpu::GPUFuncOp kernel) {
  int64_t bytes = 0;
  for (Value memory : kernel.getWorkgroupAttributions()) {
    auto type = cast<MemRefType>(memory.getType());
    Type element = type.getElementType();
    int64_t size = element.isIndex()
                       ? 8
                       : llvm::divideCeil(element.getIntOrFloatBitWidth(), 8);
    bytes += size * type.getNumElements();
  }
  return bytes;
}

/// The innermost loops of a kernel.
static SmallVector<LoopLikeOpInterface> findLoops(gpu::GPUFuncOp kernel) {
  SmallVector<LoopLikeOpInterface> loops;
  kernel.walk([&](LoopLikeOpInterface loop) {
    bool holdsOther = loop->walk([&](LoopLikeOpInterface inner) {
                            return inner == loop ? WalkResult::advance()
                                                 : WalkResult::interrupt();
                          })
                          .wasInterrupted();
    if (!holdsOther)
      loops.push_back(loop);
  });
  return loops;
}

void SpillToBlockPass::runOnOperation() {
  for (auto kernel : getOperation().getOps<gpu::GPUFuncOp>()) {
    DenseI32ArrayAttr size = kernel.getKnownBlockSizeAttr();
    if (!kernel.isKernel() || !size || !isBounded(kernel))
      continue;
    int64_t room = (fewSharedBytes - getBlockBytes(kernel)) / size[0],
            bytesLeft = std::min(maxBytes.getValue(), room);
    for (LoopLikeOpInterface loop : findLoops(kernel))
      Spiller(kernel, loop, size[0]).run(maxRegisters, bytesLeft);
  }
}
