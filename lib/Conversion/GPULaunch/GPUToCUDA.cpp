// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// convert-gpu-to-cuda: launches as calls of the runtime's part for CUDA.

#include "LaunchCall.h"

#include "Piko/Conversion/KernelImage.h"
#include "Piko/Conversion/Passes.h"

#include "mlir/Interfaces/FunctionInterfaces.h"

namespace piko {
#define GEN_PASS_DEF_CONVERTGPUTOCUDA
#include "Piko/Conversion/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {
struct ConvertGPUToCUDAPass
    : piko::impl::ConvertGPUToCUDABase<ConvertGPUToCUDAPass> {
  void runOnOperation() override;

private:
  LogicalResult declareImage(gpu::GPUModuleOp kernels);
  LogicalResult convert(gpu::LaunchFuncOp launch);
  Value createText(OpBuilder &builder, Location loc, StringRef text);
};
} // namespace

/// Lets the setup of the pipeline name the image, which the translation to LLVM
/// IR makes of the kernels.
LogicalResult ConvertGPUToCUDAPass::declareImage(gpu::GPUModuleOp kernels) {
  ModuleOp module = getOperation();
  StringRef pipeline = kernels.getName();
  pipeline.consume_back(kernelsSuffix);
  std::string name = (pipeline + ".setup").str();
  auto setup = module.lookupSymbol<FunctionOpInterface>(name);
  if (!setup || setup.isExternal())
    return kernels.emitError("expected a function '")
           << name << "' beside the kernels";
  Location loc = kernels.getLoc();
  Type pointer = LLVM::LLVMPointerType::get(&getContext());
  std::string image = getImageName(kernels.getName());
  OpBuilder builder(module.getBodyRegion());
  LLVM::GlobalOp::create(
      builder, loc, LLVM::LLVMArrayType::get(builder.getI8Type(), 0),
      /*isConstant=*/true, LLVM::Linkage::External, image, Attribute());
  auto callee =
      declareFunction(module, "pikoir_cuda_module", {pointer, pointer});
  builder.setInsertionPointToStart(&setup.getFunctionBody().front());
  LLVM::CallOp::create(
      builder, loc, callee,
      ValueRange{setup.getArgument(0),
                 LLVM::AddressOfOp::create(builder, loc, pointer, image)});
  return success();
}

Value ConvertGPUToCUDAPass::createText(OpBuilder &builder, Location loc,
                                       StringRef text) {
  std::string name = (text + ".name").str();
  Type pointer = LLVM::LLVMPointerType::get(&getContext());
  if (!getOperation().lookupSymbol(name)) {
    std::string bytes = text.str() + '\0';
    OpBuilder top(getOperation().getBodyRegion());
    LLVM::GlobalOp::create(
        top, loc, LLVM::LLVMArrayType::get(top.getI8Type(), bytes.size()),
        /*isConstant=*/true, LLVM::Linkage::Internal, name,
        top.getStringAttr(bytes));
  }
  return LLVM::AddressOfOp::create(builder, loc, pointer, name);
}

LogicalResult ConvertGPUToCUDAPass::convert(gpu::LaunchFuncOp launch) {
  FailureOr<LaunchCall> call = createLaunchCall(launch);
  if (failed(call))
    return failure();
  OpBuilder builder(launch);
  Location loc = launch.getLoc();
  Type pointer = LLVM::LLVMPointerType::get(&getContext());
  Type i64 = builder.getI64Type();
  auto callee = declareFunction(getOperation(), "pikoir_cuda_launch",
                                {pointer, pointer, i64, i64, pointer, i64});
  Value kernel = createText(builder, loc, launch.getKernelName().getValue());
  LLVM::CallOp::create(
      builder, loc, callee,
      ValueRange{call->pipeline, kernel, call->blocks, call->threads,
                 call->arguments,
                 LLVM::ConstantOp::create(
                     builder, loc, builder.getI64IntegerAttr(call->count))});
  return success();
}

void ConvertGPUToCUDAPass::runOnOperation() {
  for (auto kernels :
       llvm::to_vector(getOperation().getOps<gpu::GPUModuleOp>()))
    if (failed(declareImage(kernels)))
      return signalPassFailure();
  if (failed(convertLaunches(getOperation(), [&](gpu::LaunchFuncOp launch) {
        return convert(launch);
      })))
    signalPassFailure();
}
