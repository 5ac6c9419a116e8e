// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// convert-gpu-to-exact-nvvm: kernels to the nvvm and llvm dialects.

#include "GPUToNVVM/ExactFunctions.h"

#include "Piko/Analysis/TargetModel.h"
#include "Piko/Conversion/Passes.h"
#include "Piko/Dialect/Piko/IR/PikoGPU.h"

#include "mlir/Conversion/ArithToLLVM/ArithToLLVM.h"
#include "mlir/Conversion/ControlFlowToLLVM/ControlFlowToLLVM.h"
#include "mlir/Conversion/FuncToLLVM/ConvertFuncToLLVM.h"
#include "mlir/Conversion/GPUToNVVM/GPUToNVVMPass.h"
#include "mlir/Conversion/LLVMCommon/ConversionTarget.h"
#include "mlir/Conversion/LLVMCommon/Pattern.h"
#include "mlir/Conversion/LLVMCommon/TypeConverter.h"
#include "mlir/Conversion/MathToLLVM/MathToLLVM.h"
#include "mlir/Conversion/MemRefToLLVM/MemRefToLLVM.h"
#include "mlir/Conversion/UBToLLVM/UBToLLVM.h"
#include "mlir/Dialect/Arith/Transforms/Passes.h"
#include "mlir/Dialect/GPU/IR/GPUDialect.h"
#include "mlir/Dialect/LLVMIR/NVVMDialect.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Transforms/DialectConversion.h"

namespace piko {
#define GEN_PASS_DEF_CONVERTGPUTOEXACTNVVM
#include "Piko/Conversion/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {
struct ConvertGPUToExactNVVMPass
    : piko::impl::ConvertGPUToExactNVVMBase<ConvertGPUToExactNVVMPass> {
  void runOnOperation() override;
};
} // namespace

namespace {
/// A call of a function that is declared on first use.
struct DeviceCallLowering : ConvertOpToLLVMPattern<DeviceCallOp> {
  using ConvertOpToLLVMPattern::ConvertOpToLLVMPattern;
  LogicalResult
  matchAndRewrite(DeviceCallOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override;

private:
  /// A memref as a pointer that is of no address space.
  Value toPointer(Value memref, Value descriptor, OpBuilder &builder) const;
};
} // namespace

Value DeviceCallLowering::toPointer(Value memref, Value descriptor,
                                    OpBuilder &builder) const {
  Location loc = memref.getLoc();
  Value pointer = MemRefDescriptor(descriptor)
                      .bufferPtr(builder, loc, *getTypeConverter(),
                                 cast<MemRefType>(memref.getType()));
  auto generic = LLVM::LLVMPointerType::get(builder.getContext());
  return pointer.getType() == generic
             ? pointer
             : LLVM::AddrSpaceCastOp::create(builder, loc, generic, pointer)
                   .getResult();
}

LogicalResult
DeviceCallLowering::matchAndRewrite(DeviceCallOp op, OpAdaptor adaptor,
                                    ConversionPatternRewriter &rewriter) const {
  SmallVector<Value> arguments;
  for (auto [operand, converted] : llvm::zip(op.getArgs(), adaptor.getArgs()))
    arguments.push_back(isa<MemRefType>(operand.getType())
                            ? toPointer(operand, converted, rewriter)
                            : converted);
  Type result = op.getResult()
                    ? typeConverter->convertType(op.getResult().getType())
                    : Type(LLVM::LLVMVoidType::get(op.getContext()));
  auto kernels = op->getParentOfType<gpu::GPUModuleOp>();
  auto callee = kernels.lookupSymbol<LLVM::LLVMFuncOp>(op.getCallee());
  if (!callee) {
    OpBuilder::InsertionGuard guard(rewriter);
    rewriter.setInsertionPointToStart(kernels.getBody());
    callee = LLVM::LLVMFuncOp::create(
        rewriter, op.getLoc(), op.getCallee(),
        LLVM::LLVMFunctionType::get(
            result, llvm::to_vector(ValueRange(arguments).getTypes())));
  }
  rewriter.replaceOpWithNewOp<LLVM::CallOp>(op, callee, arguments);
  return success();
}

static bool isInSharedMemory(Value pointer) {
  return cast<LLVM::LLVMPointerType>(pointer.getType()).getAddressSpace() ==
         unsigned(NVVM::NVVMMemorySpace::Shared);
}

/// Says of access to a block's shared memory what memref cannot. Of a load that
/// is not to be kept, LLVM has to know that it cannot go before its loop; and
/// ptxas, how many registers that is for.
static void finishBlockMemory(Operation *op) {
  if (auto atomic = dyn_cast<LLVM::AtomicRMWOp>(op);
      atomic && isInSharedMemory(atomic.getPtr())) {
    // Barriers order what a block's threads see; an atomic has no need to.
    atomic.setOrdering(LLVM::AtomicOrdering::monotonic);
    atomic.setSyncscope("block");
  }
  auto load = dyn_cast<LLVM::LoadOp>(op);
  if (!load || !load.getNontemporal() || !isInSharedMemory(load.getAddr()))
    return;
  load.setNontemporal(false);
  load.setVolatile_(true);
  op->getParentOfType<LLVM::LLVMFuncOp>()->setAttr(
      NVVM::NVVMDialect::getMaxnregAttrName(),
      OpBuilder(op).getI32IntegerAttr(halfOccupancyRegisters));
}

/// What memory has pointers to, records and state, is global memory: nothing
/// stores the address of a thread's memory, or a block's. A load of an address
/// with its space needs no test of it, and LLVM sees more.
static void loadInGlobalSpace(LLVM::LoadOp load) {
  auto generic = dyn_cast<LLVM::LLVMPointerType>(load.getType());
  if (!generic || generic.getAddressSpace() != 0)
    return;
  OpBuilder builder(load->getContext());
  builder.setInsertionPointAfter(load);
  load.getResult().setType(LLVM::LLVMPointerType::get(
      load->getContext(), unsigned(NVVM::NVVMMemorySpace::Global)));
  auto cast = LLVM::AddrSpaceCastOp::create(builder, load.getLoc(), generic,
                                            load.getResult());
  load.getResult().replaceAllUsesExcept(cast, cast);
}

void ConvertGPUToExactNVVMPass::runOnOperation() {
  gpu::GPUModuleOp module = getOperation();
  WalkResult result = module.walk([](Operation *op) -> WalkResult {
    if (hasOtherBitsInPTX(op))
      return op->emitOpError("expected a function that PTX has exactly");
    return WalkResult::advance();
  });
  if (result.wasInterrupted())
    return signalPassFailure();

  LLVMTypeConverter converter(&getContext());
  configureGpuToNVVMTypeConverter(converter);
  RewritePatternSet patterns(&getContext());
  populateGpuToNVVMConversionPatterns(converter, patterns);
  arith::populateCeilFloorDivExpandOpsPatterns(patterns);
  arith::populateArithToLLVMConversionPatterns(converter, patterns);
  cf::populateControlFlowToLLVMConversionPatterns(converter, patterns);
  populateFinalizeMemRefToLLVMConversionPatterns(converter, patterns);
  populateFuncToLLVMConversionPatterns(converter, patterns);
  populateMathToLLVMConversionPatterns(converter, patterns);
  ub::populateUBToLLVMConversionPatterns(converter, patterns);
  patterns.add<DeviceCallLowering>(converter);
  LLVMConversionTarget target(getContext());
  target.addLegalDialect<NVVM::NVVMDialect>();
  target.addLegalOp<gpu::GPUModuleOp>();
  if (failed(applyFullConversion(module, target, std::move(patterns))))
    return signalPassFailure();
  module.walk([](Operation *op) { finishBlockMemory(op); });
  module.walk(loadInGlobalSpace);
}
