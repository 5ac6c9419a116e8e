// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// convert-gpu-to-cuda: launches as calls of the runtime's part for CUDA.

#include "GPULaunch/StepTable.h"

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
  LogicalResult declareImages(gpu::GPUModuleOp kernels);
  void nameKernels(OpBuilder &setup, Value pipeline, gpu::GPUModuleOp kernels);
  LogicalResult convert(gpu::LaunchFuncOp launch);
  Value createName(OpBuilder &builder, gpu::LaunchFuncOp launch);
  /// The address of a constant, which ends with a zero byte.
  Value createText(OpBuilder &builder, Location loc, std::string symbol,
                   StringRef text);
};
} // namespace

/// Lets the setup of the pipeline name the images, which the translation to
/// LLVM IR makes of the kernels.
LogicalResult ConvertGPUToCUDAPass::declareImages(gpu::GPUModuleOp kernels) {
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
  std::string images = getImagesName(kernels.getName());
  OpBuilder builder(module.getBodyRegion());
  LLVM::GlobalOp::create(
      builder, loc, LLVM::LLVMArrayType::get(builder.getI8Type(), 0),
      /*isConstant=*/true, LLVM::Linkage::External, images, Attribute());
  auto callee =
      declareFunction(module, "pikoir_cuda_module", {pointer, pointer});
  builder.setInsertionPointToStart(&setup.getFunctionBody().front());
  LLVM::CallOp::create(
      builder, loc, callee,
      ValueRange{setup.getArgument(0),
                 LLVM::AddressOfOp::create(builder, loc, pointer, images)});
  nameKernels(builder, setup.getArgument(0), kernels);
  return createStepTable(setup, builder,
                         [&](OpBuilder &at, gpu::LaunchFuncOp launch) {
                           return createName(at, launch);
                         });
}

/// The stage of a kernel, as piko-form-grids has left it; null if nothing
/// is known.
static NameLoc findStage(Location location) {
  NameLoc found;
  location->walk([&](Location inner) {
    found = dyn_cast<NameLoc>(inner);
    return found ? WalkResult::interrupt() : WalkResult::advance();
  });
  return found;
}

/// "file:line", or nothing.
static std::string describePlace(Location location) {
  std::string text;
  location->walk([&](Location inner) {
    auto file = dyn_cast<FileLineColLoc>(inner);
    if (!file)
      return WalkResult::advance();
    text = (file.getFilename().getValue() + ":" + Twine(file.getLine())).str();
    return WalkResult::interrupt();
  });
  return text;
}

/// Tells the runtime where kernels come from, for its messages.
void ConvertGPUToCUDAPass::nameKernels(OpBuilder &setup, Value pipeline,
                                       gpu::GPUModuleOp kernels) {
  Location loc = kernels.getLoc();
  Type pointer = LLVM::LLVMPointerType::get(&getContext());
  for (auto kernel : kernels.getOps<FunctionOpInterface>()) {
    NameLoc stage = findStage(kernel.getLoc());
    if (!stage)
      continue;
    auto callee = declareFunction(getOperation(), "pikoir_cuda_kernel",
                                  {pointer, pointer, pointer, pointer});
    auto text = [&](StringRef suffix, StringRef value) {
      return createText(setup, loc, (kernel.getName() + suffix).str(), value);
    };
    Value name = text(".name", kernel.getName());
    Value stageName = text(".stage", stage.getName().getValue());
    Value place = text(".place", describePlace(stage.getChildLoc()));
    LLVM::CallOp::create(setup, loc, callee,
                         ValueRange{pipeline, name, stageName, place});
  }
}

Value ConvertGPUToCUDAPass::createText(OpBuilder &builder, Location loc,
                                       std::string name, StringRef text) {
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

Value ConvertGPUToCUDAPass::createName(OpBuilder &builder,
                                       gpu::LaunchFuncOp launch) {
  StringRef name = launch.getKernelName().getValue();
  return createText(builder, launch.getLoc(), (name + ".name").str(), name);
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
  Value kernel = createName(builder, launch);
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
    if (failed(declareImages(kernels)))
      return signalPassFailure();
  if (failed(convertLaunches(getOperation(), [&](gpu::LaunchFuncOp launch) {
        return convert(launch);
      })))
    signalPassFailure();
}
