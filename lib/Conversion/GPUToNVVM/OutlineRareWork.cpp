// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-outline-rare-work: for each loop, or region, of a kernel that is marked
// as rare,
//   1. make a function of it, which gets by value what the loop uses, but for
//      what it can compute as well from constants and the thread's number;
//   2. pass the kernel's own parameters in shared memory: as arguments
//      they would all need registers at once, and drive others to the stack;
//   3. move private arrays there that only the loop uses; of others it has a
//      copy, which comes back as results, so that the kernel's own stay in
//      registers;
//   4. forbid to inline it again, and bound the registers of both.

#include "Piko/Analysis/TargetModel.h"
#include "Piko/Conversion/Passes.h"

#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/Dialect/GPU/IR/GPUDialect.h"
#include "mlir/Dialect/LLVMIR/NVVMDialect.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/IRMapping.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"
#include "mlir/Transforms/RegionUtils.h"
#include "llvm/ADT/SetVector.h"

namespace piko {
#define GEN_PASS_DEF_OUTLINERAREWORK
#include "Piko/Conversion/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct OutlineRareWorkPass
    : piko::impl::OutlineRareWorkBase<OutlineRareWorkPass> {
  void runOnOperation() override;
};

/// Makes a function of a loop or region.
class Outlining {
public:
  Outlining(Operation *loop, SymbolTable &symbols)
      : loop(loop), kernel(loop->getParentOfType<gpu::GPUFuncOp>()),
        symbols(symbols), loc(loop->getLoc()) {}
  void run();

private:
  void sortCaptures();
  void sortCapture(Value capture);
  bool canRepeat(Value value, int depth = 0);
  /// The parameters, by way of shared memory.
  void passParameters(OpBuilder &caller);
  void takeParameters(OpBuilder &builder, Value memory, IRMapping &mapping);
  func::FuncOp createFunction();
  /// Loads, or stores, all elements of the arrays that both sides have.
  void loadAll(OpBuilder &builder, ArrayRef<memref::AllocaOp> arrays,
               SmallVectorImpl<Value> &values);
  void storeAll(OpBuilder &builder, ArrayRef<memref::AllocaOp> arrays,
                ValueRange values);

  Operation *loop;
  gpu::GPUFuncOp kernel;
  SymbolTable &symbols;
  Location loc;
  SmallVector<Value> arguments, parameters;
  llvm::SetVector<Operation *> repeated;
  SmallVector<memref::AllocaOp> own, copied;
};

} // namespace

/// An array of so few numbers that they can be arguments.
static bool isSmall(memref::AllocaOp array) {
  return array.getType().hasStaticShape() && array.getType().getRank() == 1 &&
         array.getType().getNumElements() <= 16;
}

/// Whether a value can be computed again of constants and the thread's number;
/// then its operations are in `repeated`, in order.
bool Outlining::canRepeat(Value value, int depth) {
  Operation *made = value.getDefiningOp();
  if (!made || depth > 8)
    return false;
  if (repeated.contains(made))
    return true;
  bool isSource =
      made->hasTrait<OpTrait::ConstantLike>() ||
      isa<gpu::ThreadIdOp, gpu::BlockIdOp, LLVM::AddressOfOp, LLVM::ZeroOp>(
          made);
  if (!isSource &&
      (made->getNumRegions() || !isPure(made) || !made->getNumOperands() ||
       !llvm::all_of(made->getOperands(), [&](Value operand) {
         return canRepeat(operand, depth + 1);
       })))
    return false;
  repeated.insert(made);
  return true;
}

void Outlining::sortCapture(Value capture) {
  auto array = capture.getDefiningOp<memref::AllocaOp>();
  bool isOwn = array && llvm::all_of(array->getUsers(), [&](Operation *user) {
                 return loop->isAncestor(user);
               });
  bool isParameter =
      llvm::is_contained(kernel.getArguments().take_front(
                             kernel.getFunctionType().getNumInputs()),
                         capture) &&
      (isa<LLVM::LLVMPointerType>(capture.getType()) ||
       capture.getType().isInteger(64));
  if (isOwn)
    own.push_back(array);
  else if (array && isSmall(array))
    copied.push_back(array);
  else if (isParameter)
    parameters.push_back(capture);
  else if (!canRepeat(capture))
    arguments.push_back(capture);
}

void Outlining::sortCaptures() {
  llvm::SetVector<Value> captures(loop->operand_begin(), loop->operand_end());
  getUsedValuesDefinedAbove(loop->getRegion(0), captures);
  for (Value capture : captures)
    sortCapture(capture);
}

/// Each thread finds there what it has written itself: all write the same.
void Outlining::passParameters(OpBuilder &caller) {
  if (parameters.empty())
    return;
  Type i64 = caller.getI64Type();
  auto space = gpu::AddressSpaceAttr::get(
      caller.getContext(), gpu::GPUDialect::getWorkgroupAddressSpace());
  int64_t count = parameters.size();
  Value memory = kernel.addWorkgroupAttribution(
      MemRefType::get(count, i64, MemRefLayoutAttrInterface(), space), loc);
  for (auto [i, parameter] : llvm::enumerate(parameters)) {
    Value word = parameter;
    if (!word.getType().isInteger())
      word = LLVM::PtrToIntOp::create(caller, loc, i64, word);
    Value at = arith::ConstantIndexOp::create(caller, loc, i);
    memref::StoreOp::create(caller, loc, word, memory, at);
  }
  arguments.push_back(memory);
}

void Outlining::takeParameters(OpBuilder &builder, Value memory,
                               IRMapping &mapping) {
  for (auto [i, parameter] : llvm::enumerate(parameters)) {
    Value at = arith::ConstantIndexOp::create(builder, loc, i);
    Value word = memref::LoadOp::create(builder, loc, memory, at);
    if (!parameter.getType().isInteger()) {
      // As a kernel's own parameters do, it points to global memory.
      auto global = LLVM::LLVMPointerType::get(
          builder.getContext(), unsigned(NVVM::NVVMMemorySpace::Global));
      word = LLVM::IntToPtrOp::create(builder, loc, global, word);
      word = LLVM::AddrSpaceCastOp::create(builder, loc, parameter.getType(),
                                           word);
    }
    mapping.map(parameter, word);
  }
}

void Outlining::loadAll(OpBuilder &builder, ArrayRef<memref::AllocaOp> arrays,
                        SmallVectorImpl<Value> &values) {
  for (memref::AllocaOp array : arrays)
    for (int64_t i = 0, e = array.getType().getNumElements(); i < e; ++i) {
      Value at = arith::ConstantIndexOp::create(builder, loc, i);
      values.push_back(memref::LoadOp::create(builder, loc, array, at));
    }
}

void Outlining::storeAll(OpBuilder &builder, ArrayRef<memref::AllocaOp> arrays,
                         ValueRange values) {
  for (memref::AllocaOp array : arrays)
    for (int64_t i = 0, e = array.getType().getNumElements(); i < e; ++i) {
      Value at = arith::ConstantIndexOp::create(builder, loc, i);
      memref::StoreOp::create(builder, loc, values.front(), array, at);
      values = values.drop_front();
    }
}

func::FuncOp Outlining::createFunction() {
  SmallVector<Type> inputs(ValueRange(arguments).getTypes()), results;
  for (memref::AllocaOp array : copied)
    results.append(array.getType().getNumElements(),
                   array.getType().getElementType());
  llvm::append_range(inputs, results);
  llvm::append_range(results, loop->getResultTypes());
  OpBuilder builder(kernel);
  auto function =
      func::FuncOp::create(builder, loc, (kernel.getName() + "_rare").str(),
                           builder.getFunctionType(inputs, results));
  function->setAttr(
      "llvm.linkage",
      LLVM::LinkageAttr::get(builder.getContext(), LLVM::Linkage::Internal));
  function->setAttr("passthrough", builder.getStrArrayAttr({"noinline"}));
  symbols.insert(function, Block::iterator(kernel));
  return function;
}

void Outlining::run() {
  sortCaptures();
  OpBuilder caller(loop);
  passParameters(caller);
  SmallVector<Value> values = arguments;
  loadAll(caller, copied, values);
  func::FuncOp function = createFunction();
  auto call = func::CallOp::create(caller, loc, function, values);
  storeAll(caller, copied, call.getResults());
  loop->replaceAllUsesWith(call.getResults().take_back(loop->getNumResults()));
  // It is the function that spills.
  kernel->setAttr(NVVM::NVVMDialect::getMaxnregAttrName(),
                  caller.getI32IntegerAttr(halfOccupancyRegisters));

  Block *body = function.addEntryBlock();
  OpBuilder builder = OpBuilder::atBlockBegin(body);
  IRMapping mapping;
  mapping.map(arguments, body->getArguments().take_front(arguments.size()));
  for (Operation *op : repeated)
    builder.clone(*op, mapping);
  if (!parameters.empty())
    takeParameters(builder, mapping.lookup(arguments.back()), mapping);
  for (memref::AllocaOp array : own)
    builder.clone(*array, mapping);
  SmallVector<memref::AllocaOp> copies;
  for (memref::AllocaOp array : copied)
    copies.push_back(cast<memref::AllocaOp>(builder.clone(*array, mapping)));
  storeAll(builder, copies, body->getArguments().drop_front(arguments.size()));
  Operation *work = builder.clone(*loop, mapping);
  work->removeAttr(marks::rare);
  SmallVector<Value> results;
  loadAll(builder, copies, results);
  llvm::append_range(results, work->getResults());
  func::ReturnOp::create(builder, loc, results);
  loop->erase();
  for (memref::AllocaOp array : own)
    array.erase();
}

void OutlineRareWorkPass::runOnOperation() {
  SymbolTable symbols(getOperation());
  SmallVector<Operation *> loops;
  getOperation().walk([&](Operation *op) {
    bool isLoop = isa<scf::ForOp>(op) && !op->getNumResults();
    if (op->hasAttr(marks::rare) && (isLoop || isa<scf::ExecuteRegionOp>(op)))
      loops.push_back(op);
  });
  for (Operation *loop : loops)
    Outlining(loop, symbols).run();
}
