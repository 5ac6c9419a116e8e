// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// convert-gpu-to-scf: a kernel on a CPU. Barriers cut the kernel, and the loops
// that hold them, into pieces; each piece becomes a loop over threads. For
// that, an operation at the level of barriers is one of three:
//   uniform    the same for all threads: done once, between the pieces
//   cheap      without effects: done again in each piece that needs its result
//   a thread's own, which belongs to its piece

#include "Piko/Conversion/Passes.h"

#include "mlir/Dialect/GPU/IR/GPUDialect.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/Dialect/Utils/StaticValueUtils.h"
#include "mlir/IR/IRMapping.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"

namespace piko {
#define GEN_PASS_DEF_CONVERTGPUTOSCF
#include "Piko/Conversion/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

/// Writes the function that runs one block of a kernel.
class BlockWriter {
public:
  BlockWriter(gpu::GPUFuncOp kernel, int64_t threads, bool reverse)
      : kernel(kernel), loc(kernel.getLoc()), threads(threads),
        reverse(reverse), allocations(kernel.getContext()),
        builder(kernel.getContext()) {}

  /// The function takes the block, the number of blocks, and the kernel's
  /// arguments; null after an error.
  func::FuncOp write(ModuleOp module);

private:
  using Piece = SmallVector<Operation *>;

  void createBlockMemory();
  LogicalResult writeBody(Block &body);
  LogicalResult writeLoop(scf::ForOp loop);
  LogicalResult writePiece(const Piece &piece);
  void addPrivateArray(memref::AllocaOp array);
  bool isUniform(Operation *op, const Piece &piece);
  bool isOwn(Operation *op);
  Value getUniformId(Operation *op);

  /// Makes the operands of `op` known for the thread of a piece.
  LogicalResult prepare(Operation *op, Value thread, IRMapping &values);
  LogicalResult prepare(Value value, Operation *user, Value thread,
                        IRMapping &values);

  gpu::GPUFuncOp kernel;
  Location loc;
  int64_t threads;
  bool reverse;
  /// At the function's front, and where it has come to.
  OpBuilder allocations, builder;
  SmallVector<Value> allocated;
  func::FuncOp function;
  /// What is the same for all threads.
  IRMapping uniform;
  /// Private arrays, with room for all threads.
  llvm::DenseMap<Value, Value> arrays;
};

struct ConvertGPUToSCFPass
    : piko::impl::ConvertGPUToSCFBase<ConvertGPUToSCFPass> {
  using ConvertGPUToSCFBase::ConvertGPUToSCFBase;
  void runOnOperation() override;
  LogicalResult convert(gpu::LaunchFuncOp launch);
};

} // namespace

static bool hasBarrier(Operation *op) {
  return op->walk([](gpu::BarrierOp) { return WalkResult::interrupt(); })
      .wasInterrupted();
}

static bool isCheap(Operation *op) {
  return op->getNumRegions() == 0 && isMemoryEffectFree(op);
}

static bool isOnlyReading(Operation *op) {
  return op->getNumRegions() == 0 && hasSingleEffect<MemoryEffects::Read>(op);
}

func::FuncOp BlockWriter::write(ModuleOp module) {
  SmallVector<Type> inputs(2, builder.getIndexType());
  llvm::append_range(inputs, kernel.getArgumentTypes());
  builder.setInsertionPointToEnd(module.getBody());
  auto parent = kernel->getParentOfType<gpu::GPUModuleOp>();
  function = func::FuncOp::create(
      builder, loc, (parent.getName() + "." + kernel.getName()).str(),
      builder.getFunctionType(inputs, {}));
  function.setPrivate();
  Block *entry = function.addEntryBlock();
  builder.setInsertionPointToEnd(entry);
  auto end = func::ReturnOp::create(builder, loc);
  allocations.setInsertionPoint(end);
  // What divides the two parts.
  Operation *front = arith::ConstantIndexOp::create(builder, loc, 0);
  front->moveBefore(end);
  allocations.setInsertionPoint(front);
  builder.setInsertionPoint(end);
  for (auto [argument, value] :
       llvm::zip(kernel.getArguments(), entry->getArguments().drop_front(2)))
    uniform.map(argument, value);
  createBlockMemory();
  if (failed(writeBody(kernel.getBody().front())))
    return {};
  for (Value memory : allocated)
    memref::DeallocOp::create(builder, loc, memory);
  front->erase();
  return function;
}

void BlockWriter::createBlockMemory() {
  for (BlockArgument memory : kernel.getWorkgroupAttributions()) {
    auto type = cast<MemRefType>(memory.getType());
    auto plain = MemRefType::get(type.getShape(), type.getElementType());
    allocated.push_back(memref::AllocOp::create(allocations, loc, plain));
    uniform.map(memory, allocated.back());
  }
}

void BlockWriter::addPrivateArray(memref::AllocaOp array) {
  auto type = MemRefType::get({threads * array.getType().getNumElements()},
                              array.getType().getElementType());
  allocated.push_back(
      memref::AllocOp::create(allocations, array.getLoc(), type));
  arrays[array] = allocated.back();
}

/// Block and grid, where `op` asks for them along x; the others have one.
Value BlockWriter::getUniformId(Operation *op) {
  auto pick = [&](gpu::Dimension dimension, Value x, int64_t other) {
    return dimension == gpu::Dimension::x
               ? x
               : arith::ConstantIndexOp::create(builder, loc, other)
                     .getResult();
  };
  if (auto id = dyn_cast<gpu::BlockIdOp>(op))
    return pick(id.getDimension(), function.getArgument(0), 0);
  if (auto id = dyn_cast<gpu::GridDimOp>(op))
    return pick(id.getDimension(), function.getArgument(1), 1);
  if (auto id = dyn_cast<gpu::BlockDimOp>(op))
    return arith::ConstantIndexOp::create(
        builder, loc, id.getDimension() == gpu::Dimension::x ? threads : 1);
  if (auto id = dyn_cast<gpu::ThreadIdOp>(op);
      id && id.getDimension() != gpu::Dimension::x)
    return arith::ConstantIndexOp::create(builder, loc, 0);
  return {};
}

/// Whether other threads cannot see what an operation does.
bool BlockWriter::isOwn(Operation *op) {
  auto store = dyn_cast<memref::StoreOp>(op);
  return isCheap(op) || (store && arrays.contains(store.getMemRef()));
}

/// What reads memory is uniform only where no thread may have written before.
bool BlockWriter::isUniform(Operation *op, const Piece &piece) {
  if (isa<gpu::ThreadIdOp>(op) ||
      !llvm::all_of(op->getOperands(),
                    [&](Value value) { return uniform.contains(value); }))
    return false;
  return isCheap(op) ||
         (isOnlyReading(op) && llvm::all_of(piece, [&](Operation *before) {
            return isOwn(before);
          }));
}

LogicalResult BlockWriter::writeBody(Block &body) {
  Piece piece;
  auto cut = [&] {
    LogicalResult result = writePiece(piece);
    piece.clear();
    return result;
  };
  for (Operation &op : body.without_terminator()) {
    if (auto array = dyn_cast<memref::AllocaOp>(op)) {
      if (!array.getType().hasStaticShape())
        return op.emitError("expected a private array of constant size");
      addPrivateArray(array);
    } else if (Value id = getUniformId(&op)) {
      uniform.map(op.getResult(0), id);
    } else if (isa<gpu::BarrierOp>(op)) {
      if (failed(cut()))
        return failure();
    } else if (hasBarrier(&op)) {
      auto loop = dyn_cast<scf::ForOp>(op);
      if (!loop)
        return op.emitError("expected barriers in the kernel's body or in "
                            "'scf.for' only");
      if (failed(cut()) || failed(writeLoop(loop)))
        return failure();
    } else if (isUniform(&op, piece)) {
      builder.clone(op, uniform);
    } else {
      piece.push_back(&op);
    }
  }
  return cut();
}

LogicalResult BlockWriter::writeLoop(scf::ForOp loop) {
  if (loop.getNumResults())
    return loop.emitError("expected a loop with barriers to carry no values");
  for (Value bound :
       {loop.getLowerBound(), loop.getUpperBound(), loop.getStep()})
    if (!uniform.contains(bound))
      return loop.emitError("expected a loop with barriers to have the same "
                            "bounds for all threads");
  auto copy = scf::ForOp::create(
      builder, loop.getLoc(), uniform.lookup(loop.getLowerBound()),
      uniform.lookup(loop.getUpperBound()), uniform.lookup(loop.getStep()));
  copy.setUnsignedCmp(loop.getUnsignedCmp());
  uniform.map(loop.getInductionVar(), copy.getInductionVar());
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPoint(copy.getBody()->getTerminator());
  return writeBody(*loop.getBody());
}

LogicalResult BlockWriter::writePiece(const Piece &piece) {
  if (llvm::all_of(piece, isCheap))
    return success();
  auto number = [&](int64_t value) {
    return arith::ConstantIndexOp::create(builder, loc, value);
  };
  auto loop =
      scf::ForOp::create(builder, loc, number(0), number(threads), number(1));
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPoint(loop.getBody()->getTerminator());
  Value thread = loop.getInductionVar();
  if (reverse)
    thread = arith::SubIOp::create(builder, loc, number(threads - 1), thread);
  IRMapping values = uniform;
  for (Operation *op : piece) {
    if (isCheap(op))
      continue;
    if (failed(prepare(op, thread, values)))
      return failure();
    builder.clone(*op, values);
  }
  return success();
}

LogicalResult BlockWriter::prepare(Operation *op, Value thread,
                                   IRMapping &values) {
  WalkResult result = op->walk([&](Operation *inner) -> WalkResult {
    for (Value value : inner->getOperands())
      if (!op->isAncestor(value.getParentBlock()->getParentOp()) &&
          failed(prepare(value, inner, thread, values)))
        return failure();
    return WalkResult::advance();
  });
  return failure(result.wasInterrupted());
}

LogicalResult BlockWriter::prepare(Value value, Operation *user, Value thread,
                                   IRMapping &values) {
  if (values.contains(value))
    return success();
  Operation *op = value.getDefiningOp();
  if (isa_and_nonnull<gpu::ThreadIdOp>(op)) {
    values.map(value, thread);
    return success();
  }
  if (auto found = arrays.find(value); found != arrays.end()) {
    auto type = cast<MemRefType>(value.getType());
    Value size =
        arith::ConstantIndexOp::create(builder, loc, type.getNumElements());
    OpFoldResult offset =
        arith::MulIOp::create(builder, loc, thread, size).getResult();
    SmallVector<OpFoldResult> sizes, strides;
    auto [typeStrides, typeOffset] = type.getStridesAndOffset();
    for (auto [extent, stride] : llvm::zip(type.getShape(), typeStrides)) {
      sizes.push_back(builder.getIndexAttr(extent));
      strides.push_back(builder.getIndexAttr(stride));
    }
    auto layout = StridedLayoutAttr::get(builder.getContext(),
                                         ShapedType::kDynamic, typeStrides);
    values.map(value, memref::ReinterpretCastOp::create(
                          builder, loc,
                          MemRefType::get(type.getShape(),
                                          type.getElementType(), layout),
                          found->second, offset, sizes, strides));
    return success();
  }
  if (!op || !isCheap(op)) {
    InFlightDiagnostic error =
        user->emitError("expected no value to live across a barrier, or out of "
                        "a loop with barriers");
    error.attachNote(value.getLoc()) << "the value is from here";
    return error;
  }
  if (failed(prepare(op, thread, values)))
    return failure();
  builder.clone(*op, values);
  return success();
}

/// In the place of a launch, a loop over its blocks.
LogicalResult ConvertGPUToSCFPass::convert(gpu::LaunchFuncOp launch) {
  auto kernel = SymbolTable::lookupNearestSymbolFrom<gpu::GPUFuncOp>(
      launch, launch.getKernel());
  std::optional<int64_t> threads = getConstantIntValue(launch.getBlockSizeX());
  if (!kernel || !kernel.getBody().hasOneBlock())
    return launch.emitError("expected a kernel with structured control flow");
  if (!threads ||
      !llvm::all_of(
          ArrayRef<Value>{launch.getGridSizeY(), launch.getGridSizeZ(),
                          launch.getBlockSizeY(), launch.getBlockSizeZ()},
          [](Value v) { return isConstantIntValue(v, 1); }))
    return launch.emitError("expected a grid and blocks of one dimension, and "
                            "a constant number of threads");
  func::FuncOp block =
      BlockWriter(kernel, *threads, reverse).write(getOperation());
  if (!block)
    return failure();
  OpBuilder builder(launch);
  Location loc = launch.getLoc();
  Value zero = arith::ConstantIndexOp::create(builder, loc, 0);
  Value one = arith::ConstantIndexOp::create(builder, loc, 1);
  Value blocks = launch.getGridSizeX();
  auto loop = scf::ForOp::create(builder, loc, zero, blocks, one);
  builder.setInsertionPointToStart(loop.getBody());
  SmallVector<Value> arguments{loop.getInductionVar(), blocks};
  llvm::append_range(arguments, launch.getKernelOperands());
  func::CallOp::create(builder, loc, block, arguments);
  launch.erase();
  return success();
}

void ConvertGPUToSCFPass::runOnOperation() {
  SmallVector<gpu::LaunchFuncOp> launches;
  getOperation().walk(
      [&](gpu::LaunchFuncOp launch) { launches.push_back(launch); });
  for (gpu::LaunchFuncOp launch : launches)
    if (failed(convert(launch)))
      return signalPassFailure();
  for (auto module : llvm::to_vector(getOperation().getOps<gpu::GPUModuleOp>()))
    module.erase();
  getOperation()->removeAttr(gpu::GPUDialect::getContainerModuleAttrName());
}
