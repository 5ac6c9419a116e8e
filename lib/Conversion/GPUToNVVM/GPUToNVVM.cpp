// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// convert-gpu-to-exact-nvvm: kernels to the nvvm and llvm dialects.

#include "ExactFunctions.h"

#include "Piko/Conversion/Passes.h"

#include "mlir/Conversion/ArithToLLVM/ArithToLLVM.h"
#include "mlir/Conversion/ControlFlowToLLVM/ControlFlowToLLVM.h"
#include "mlir/Conversion/FuncToLLVM/ConvertFuncToLLVM.h"
#include "mlir/Conversion/GPUToNVVM/GPUToNVVMPass.h"
#include "mlir/Conversion/LLVMCommon/ConversionTarget.h"
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
  LLVMConversionTarget target(getContext());
  target.addLegalDialect<NVVM::NVVMDialect>();
  target.addLegalOp<gpu::GPUModuleOp>();
  if (failed(applyFullConversion(module, target, std::move(patterns))))
    return signalPassFailure();
  // Barriers order what a block's threads see; an atomic has no need to.
  module.walk([](LLVM::AtomicRMWOp atomic) {
    auto type = cast<LLVM::LLVMPointerType>(atomic.getPtr().getType());
    if (type.getAddressSpace() == unsigned(NVVM::NVVMMemorySpace::Shared)) {
      atomic.setOrdering(LLVM::AtomicOrdering::monotonic);
      atomic.setSyncscope("block");
    }
  });
}
