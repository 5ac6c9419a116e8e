// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "GPULaunch/LaunchCall.h"

#include "mlir/Dialect/Arith/IR/Arith.h"

using namespace mlir;
using namespace piko;

LLVM::LLVMFuncOp piko::declareFunction(ModuleOp module, StringRef name,
                                       ArrayRef<Type> arguments) {
  if (auto known = module.lookupSymbol<LLVM::LLVMFuncOp>(name))
    return known;
  OpBuilder builder(module.getBodyRegion());
  return LLVM::LLVMFuncOp::create(
      builder, module.getLoc(), name,
      LLVM::LLVMFunctionType::get(LLVM::LLVMVoidType::get(module.getContext()),
                                  arguments));
}

LogicalResult piko::storeArguments(OpBuilder &builder, gpu::LaunchFuncOp launch,
                                   ValueRange arguments, Value words) {
  Location loc = launch.getLoc();
  Type pointer = LLVM::LLVMPointerType::get(launch.getContext());
  Type i64 = builder.getI64Type();
  for (auto [i, argument] : llvm::enumerate(arguments)) {
    Value stored = argument;
    if (stored.getType().isIndex())
      stored = arith::IndexCastOp::create(builder, loc, i64, stored);
    if (!isa<LLVM::LLVMPointerType>(stored.getType()) &&
        !stored.getType().isIntOrFloat())
      return launch.emitError("expected arguments that are numbers or "
                              "pointers, but got type ")
             << stored.getType();
    Value place = LLVM::GEPOp::create(builder, loc, pointer, i64, words,
                                      ArrayRef<LLVM::GEPArg>{int32_t(i)});
    LLVM::StoreOp::create(builder, loc, stored, place);
  }
  return success();
}

FailureOr<LaunchCall> piko::createLaunchCall(gpu::LaunchFuncOp launch) {
  for (Value extent : {launch.getGridSizeY(), launch.getGridSizeZ(),
                       launch.getBlockSizeY(), launch.getBlockSizeZ()})
    if (!isConstantIntValue(extent, 1))
      return launch.emitError("expected a grid and blocks of one dimension");
  OpBuilder builder(launch);
  Location loc = launch.getLoc();
  Type pointer = LLVM::LLVMPointerType::get(launch.getContext());
  Type i64 = builder.getI64Type();
  auto function = launch->getParentOfType<func::FuncOp>();
  OpBuilder entry = OpBuilder::atBlockBegin(&function.getBody().front());
  Value room = LLVM::ConstantOp::create(
      entry, loc, entry.getI64IntegerAttr(launch.getNumKernelOperands() + 1));
  LaunchCall call;
  call.pipeline = function.getArgument(0);
  call.count = launch.getNumKernelOperands();
  call.arguments = LLVM::AllocaOp::create(entry, loc, pointer, i64, room);
  if (failed(storeArguments(builder, launch, launch.getKernelOperands(),
                            call.arguments)))
    return failure();
  auto toI64 = [&](Value index) {
    return arith::IndexCastOp::create(builder, loc, i64, index).getResult();
  };
  call.blocks = toI64(launch.getGridSizeX());
  call.threads = toI64(launch.getBlockSizeX());
  return call;
}

LogicalResult piko::convertLaunches(
    ModuleOp module,
    llvm::function_ref<LogicalResult(gpu::LaunchFuncOp)> convert) {
  SmallVector<gpu::LaunchFuncOp> launches;
  module.walk([&](gpu::LaunchFuncOp launch) { launches.push_back(launch); });
  for (gpu::LaunchFuncOp launch : launches) {
    if (failed(convert(launch)))
      return failure();
    launch.erase();
  }
  module->removeAttr(gpu::GPUDialect::getContainerModuleAttrName());
  return success();
}
