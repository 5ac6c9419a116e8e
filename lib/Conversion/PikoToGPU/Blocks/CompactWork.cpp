// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-compact-work: threads that share primitives wait for each other: where
// few primitives come to a loop, or their loops are of unlike length, most
// threads of a warp idle. Such a loop that changes state by atomics alone,
// whose order nobody sees, is put off, with the branch that it is in:
//
//   for each round of as many primitives as threads
//     mine: all else; what the branch needs, to a queue in shared memory
//     if the queue may not have room for another round, or this is the last
//       barrier
//       sort what waits by the length of its loop
//       for my part of what waits
//         the branch
//       barrier
//
// So the threads of a warp have branches (stream compaction) whose loops are
// about as long (a counting sort). Two loops that are nested become one, which
// has the length of both. The queue and what is put off are a piko.gpu.drain
// after the loop; when it is done, WorkQueue.cpp says.

#include "PikoToGPU/Blocks/LoopNest.h"
#include "PikoToGPU/Blocks/WorkQueue.h"
#include "PikoToGPU/Emitter.h"

#include "Piko/Conversion/Passes.h"
#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/IR/IRMapping.h"
#include "mlir/IR/Matchers.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"
#include "llvm/ADT/MapVector.h"
#include "llvm/ADT/SetVector.h"
#include "llvm/ADT/StringSet.h"

namespace piko {
#define GEN_PASS_DEF_COMPACTWORK
#include "Piko/Conversion/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

using Predicate = arith::CmpIPredicate;

/// Lengths up to `exact` are classes of their own, longer ones four together.
static constexpr int64_t exactLengths = 16, together = 4;
/// Of the queue: it should leave a multiprocessor room for many blocks.
static constexpr int64_t mostQueueBytes = 20 << 10;

namespace {

class WorkCompaction {
public:
  WorkCompaction(scf::ForOp loop, GridMemory &memory)
      : loop(loop), memory(memory), threads(getBlockSize(memory.launch)) {}
  void run();

private:
  bool find();
  bool canCompact(Operation *op) const;
  bool findNeeds();
  bool isOfPrimitive(Value value) const;
  int64_t countBytes() const;
  void createQueue();
  void enqueue();
  Value createClass(Emitter &b);
  Value cloneSlice(Emitter &b, Value value, IRMapping &mapping, int &left);
  void createWork();

  scf::ForOp loop;
  GridMemory &memory;
  int64_t threads;
  /// State that the kernel changes, and of which it needs what is there.
  llvm::StringSet<> written, seen;
  Operation *anchor = nullptr;
  SmallVector<Operation *> ops; ///< What is put off, with the anchor.
  llvm::SetVector<Value> needs; ///< What that needs of the primitive.
  /// As piko.gpu.drain has them.
  int64_t capacity = 0;
  Value count, lengths, starts, classes, order;
  /// Where a number is: those of one type are in one array.
  struct QueuePlace {
    Value array;
    int64_t first;
  };
  llvm::MapVector<Value, QueuePlace> places;
  QueuePlace position;
};

struct CompactWorkPass : piko::impl::CompactWorkBase<CompactWorkPass> {
  using CompactWorkBase::CompactWorkBase;
  void runOnOperation() override;
};

} // namespace

/// As it is in memory.
static Type getStorage(Type type) {
  return type.isInteger(1) ? IntegerType::get(type.getContext(), 8) : type;
}

static int64_t getBytes(Type type) {
  type = getStorage(type);
  return type.isIndex() ? 8 : llvm::divideCeil(type.getIntOrFloatBitWidth(), 8);
}

//===----------------------------------------------------------------------===//
// What can be put off
//===----------------------------------------------------------------------===//

/// Whether nobody sees when it is done, nor anybody's else what it sees.
bool WorkCompaction::canCompact(Operation *op) const {
  return !contains(op, [&](Operation *inner) {
    if (auto atomic = dyn_cast<AtomicOp>(inner))
      return atomic.getOld() || atomic.getCopy() ||
             atomic.getKind() == AtomicKind::AddF ||
             seen.contains(atomic.getState());
    if (auto load = dyn_cast<LoadOp>(inner))
      return written.contains(load.getState());
    return !inner->hasTrait<OpTrait::HasRecursiveMemoryEffects>() &&
           !isMemoryEffectFree(inner) && !isa<GetOp>(inner);
  });
}

static bool changesState(Operation *op) {
  return contains(op, [](Operation *inner) { return isa<AtomicOp>(inner); });
}

bool WorkCompaction::find() {
  memory.launch.walk([&](StateAccessOpInterface access) {
    if (access.getAccessKinds() != StateAccess::reads)
      written.insert(access.getAccessedState().getValue());
    auto atomic = dyn_cast<AtomicOp>(*access);
    if (!atomic || atomic.getOld())
      seen.insert(access.getAccessedState().getValue());
  });
  loop.getBody()->walk<WalkOrder::PreOrder>([&](Operation *op) {
    if (!isa<LoopLikeOpInterface>(op))
      return WalkResult::advance();
    if (!op->use_empty() || !changesState(op) || !canCompact(op))
      return WalkResult::skip();
    anchor = op;
    return WalkResult::interrupt();
  });
  if (!anchor)
    return false;
  ops.push_back(anchor);
  auto branch = dyn_cast<scf::IfOp>(anchor->getParentOp());
  if (!branch || branch.getNumResults())
    return true;
  SmallVector<Operation *> all;
  for (Operation &op : anchor->getBlock()->without_terminator())
    all.push_back(&op);
  if (llvm::all_of(all, [&](Operation *op) { return canCompact(op); }))
    ops = all;
  return true;
}

bool WorkCompaction::isOfPrimitive(Value value) const {
  return loop->isAncestor(value.getParentBlock()->getParentOp());
}

/// Members of a primitive are read at once: it is not known later.
bool WorkCompaction::findNeeds() {
  llvm::erase_if(ops, [](Operation *op) { return isa<GetOp>(op); });
  llvm::DenseSet<Operation *> inside(ops.begin(), ops.end());
  for (Operation *op : ops)
    op->walk([&](Operation *inner) {
      for (Value operand : inner->getOperands()) {
        Operation *around = operand.getParentBlock()->getParentOp();
        bool isInner = llvm::any_of(ops, [&](Operation *each) {
          return each->isAncestor(around) ||
                 (operand.getDefiningOp() &&
                  inside.contains(operand.getDefiningOp()));
        });
        if (!isInner && isOfPrimitive(operand) &&
            !matchPattern(operand, m_Constant()))
          needs.insert(operand);
      }
    });
  return llvm::all_of(needs, [](Value value) {
    return value.getType().isIntOrIndexOrFloat() &&
           (value.getType().isIndex() || getBytes(value.getType()) <= 8);
  });
}

//===----------------------------------------------------------------------===//
// The queue
//===----------------------------------------------------------------------===//

int64_t WorkCompaction::countBytes() const {
  int64_t bytes = 4 /*position*/ + 4 /*class*/ + 2 /*order*/;
  for (Value value : needs)
    bytes += getBytes(value.getType());
  return bytes;
}

void WorkCompaction::createQueue() {
  auto builder = OpBuilder(memory.launch);
  Type i32 = builder.getI32Type();
  auto add = [&](int64_t size, Type type) {
    return addSharedMemory(memory.launch, size, type);
  };
  count = add(1, i32);
  lengths = add(lengthClasses, i32);
  starts = add(lengthClasses, i32);
  classes = add(capacity, i32);
  order = add(capacity, builder.getI16Type());
  llvm::MapVector<Type, int64_t> sizes;
  auto place = [&](Type type) {
    int64_t &size = sizes[getStorage(type)];
    int64_t first = size;
    size += capacity;
    return first;
  };
  for (Value value : needs)
    places[value].first = place(value.getType());
  position.first = place(i32);
  llvm::DenseMap<Type, Value> arrays;
  for (auto [type, size] : sizes)
    arrays[type] = add(size, type);
  for (auto &[value, at] : places)
    at.array = arrays.lookup(getStorage(value.getType()));
  position.array = arrays.lookup(i32);
}

/// A number again, of what is known where it is put off.
Value WorkCompaction::cloneSlice(Emitter &b, Value value, IRMapping &mapping,
                                 int &left) {
  Operation *made = value.getDefiningOp();
  if (mapping.contains(value) || !made || !llvm::is_contained(ops, made))
    return mapping.lookupOrDefault(value);
  if (made->getNumRegions() || !isMemoryEffectFree(made) || left-- == 0)
    return {};
  for (Value operand : made->getOperands())
    if (!cloneSlice(b, operand, mapping, left))
      return {};
  b.clone(*made, mapping);
  return mapping.lookup(value);
}

/// The class of the loop's length; null where that is not known.
Value WorkCompaction::createClass(Emitter &b) {
  std::optional<NestLoop> outer = findNestLoop(anchor);
  if (!outer)
    return {};
  std::optional<NestLoop> inner = matchInnerLoop(*outer);
  IRMapping mapping;
  int left = 12;
  auto lengthOf = [&](const NestLoop &counted) -> Value {
    Value first = cloneSlice(b, counted.first, mapping, left),
          bound = cloneSlice(b, counted.bound, mapping, left);
    if (!first || !bound)
      return {};
    Value length = b.toNumber(b.sub(bound, first));
    if (counted.isInclusive())
      length = b.add(length, b.number(1));
    return arith::MaxSIOp::create(b, length, b.number(0));
  };
  Value length = lengthOf(*outer);
  if (length && inner)
    if (Value other = lengthOf(*inner)) {
      // Both are limited, so that the product has 32 bits.
      auto limited = [&](Value number) {
        return arith::MinSIOp::create(b, number, b.number(1 << 12));
      };
      length = b.mul(limited(length), limited(other));
    }
  if (!length)
    return {};
  Value far = b.add(b.shr(b.sub(length, b.number(exactLengths)), b.number(2)),
                    b.number(exactLengths));
  static_assert(together == 4);
  Value isNear = b.is(length, Predicate::slt, b.number(exactLengths));
  Value number = b.select(isNear, length, far);
  return arith::MinSIOp::create(b, number, b.number(lengthClasses - 1));
}

/// In the place of what is put off.
void WorkCompaction::enqueue() {
  Emitter b(loop.getLoc(), ops.back());
  constexpr auto add = arith::AtomicRMWKind::addi;
  Value zero = b.index(0), slot = b.change(add, b.number(1), count, zero);
  Value length = createClass(b);
  if (!length)
    length = b.number(0);
  Value rank = b.change(add, b.number(1), lengths, length);
  b.store(b.either(length, b.shl(rank, b.number(8))), classes, slot);
  Value at = b.toIndex(slot);
  for (auto &[value, place] : places) {
    Value stored = value;
    if (value.getType().isInteger(1))
      stored = arith::ExtUIOp::create(b, b.getI8Type(), stored);
    b.store(stored, place.array, b.add(at, b.index(place.first)));
  }
  Value number = b.sub(loop.getInductionVar(), loop.getLowerBound());
  b.store(b.cast(number, b.getI32Type()), position.array,
          b.add(at, b.index(position.first)));
}

void WorkCompaction::createWork() {
  OpBuilder builder(loop);
  builder.setInsertionPointAfter(loop);
  auto drain = DrainOp::create(builder, loop.getLoc(), count, lengths, starts,
                               classes, order);
  Block &body = drain.getBody().emplaceBlock();
  Value at = body.addArgument(builder.getIndexType(), loop.getLoc());
  Emitter in(loop.getLoc(), &body, body.end());
  Value number = in.load(position.array, in.add(at, in.index(position.first)));
  memory.setPosition(in, in.add(loop.getLowerBound(), in.toIndex(number)));
  IRMapping mapping;
  for (auto &[value, place] : places) {
    Value loaded = in.load(place.array, in.add(at, in.index(place.first)));
    if (value.getType().isInteger(1))
      loaded = arith::TruncIOp::create(in, value.getType(), loaded);
    mapping.map(value, loaded);
  }
  for (Operation *op : ops) {
    op->walk([&](Operation *inner) {
      for (Value operand : inner->getOperands())
        if (!mapping.contains(operand) && isOfPrimitive(operand) &&
            matchPattern(operand, m_Constant()) && operand.getDefiningOp() &&
            !op->isAncestor(operand.getDefiningOp()) &&
            !llvm::is_contained(ops, operand.getDefiningOp()))
          in.clone(*operand.getDefiningOp(), mapping);
    });
    Operation *copy = in.clone(*op, mapping);
    if (op == anchor)
      coalesceLoops(copy);
  }
}

void WorkCompaction::run() {
  if (threads < lengthClasses || !memory.locals.empty() || !find() ||
      !findNeeds())
    return;
  capacity = 3 * threads;
  if (capacity * countBytes() > mostQueueBytes || capacity > (1 << 15))
    return;
  createQueue();
  enqueue();
  createWork();
  for (Operation *op : llvm::reverse(ops))
    op->erase();
  OpBuilder first = OpBuilder::atBlockBegin(loop.getBody());
  memory.setPosition(first, loop.getInductionVar());
}

void CompactWorkPass::runOnOperation() {
  FailureOr<SmallVector<GridMemory>> grids = findGrids(getOperation());
  if (failed(grids))
    return signalPassFailure();
  for (GridMemory &memory : *grids)
    for (scf::ForOp loop : collect<scf::ForOp>(memory.launch))
      if (loop->hasAttr(marks::shared))
        WorkCompaction(loop, memory).run();
}
