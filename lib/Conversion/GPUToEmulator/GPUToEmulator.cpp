// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// convert-gpu-to-emulator: launches as calls of the emulator.

#include "Piko/Conversion/Emulation.h"
#include "Piko/Conversion/Passes.h"

#include "mlir/Dialect/GPU/IR/GPUDialect.h"

namespace piko {
#define GEN_PASS_DEF_CONVERTGPUTOEMULATOR
#include "Piko/Conversion/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {
struct ConvertGPUToEmulatorPass
    : piko::impl::ConvertGPUToEmulatorBase<ConvertGPUToEmulatorPass> {
  using ConvertGPUToEmulatorBase::ConvertGPUToEmulatorBase;
  void runOnOperation() override;
  LogicalResult convert(gpu::LaunchFuncOp launch);
};
} // namespace

/// A function of the emulator, declared on first use.
static LLVM::LLVMFuncOp declare(ModuleOp module, StringRef name,
                                ArrayRef<Type> arguments) {
  if (auto known = module.lookupSymbol<LLVM::LLVMFuncOp>(name))
    return known;
  OpBuilder builder(module.getBodyRegion());
  return LLVM::LLVMFuncOp::create(
      builder, module.getLoc(), name,
      LLVM::LLVMFunctionType::get(LLVM::LLVMVoidType::get(module.getContext()),
                                  arguments));
}

LogicalResult ConvertGPUToEmulatorPass::convert(gpu::LaunchFuncOp launch) {
  for (Value extent : {launch.getGridSizeY(), launch.getGridSizeZ(),
                       launch.getBlockSizeY(), launch.getBlockSizeZ()})
    if (!isConstantIntValue(extent, 1))
      return launch.emitError("expected a grid and blocks of one dimension");
  OpBuilder builder(launch);
  Location loc = launch.getLoc();
  Type pointer = LLVM::LLVMPointerType::get(&getContext());
  Type i64 = builder.getI64Type();
  auto function = launch->getParentOfType<func::FuncOp>();
  OpBuilder entry = OpBuilder::atBlockBegin(&function.getBody().front());
  Value count = LLVM::ConstantOp::create(
      entry, loc, entry.getI64IntegerAttr(launch.getNumKernelOperands() + 1));
  Value arguments = LLVM::AllocaOp::create(entry, loc, pointer, i64, count);
  for (auto [i, argument] : llvm::enumerate(launch.getKernelOperands())) {
    if (argument.getType().isIndex())
      argument = arith::IndexCastOp::create(builder, loc, i64, argument);
    if (!isa<LLVM::LLVMPointerType>(argument.getType()) &&
        !argument.getType().isIntOrFloat())
      return launch.emitError("expected arguments that are numbers or "
                              "pointers, but got type ")
             << argument.getType();
    Value place = LLVM::GEPOp::create(builder, loc, pointer, i64, arguments,
                                      ArrayRef<LLVM::GEPArg>{int32_t(i)});
    LLVM::StoreOp::create(builder, loc, argument, place);
  }
  std::string thread = getEmulatedName(launch.getKernelModuleName().getValue(),
                                       launch.getKernelName().getValue());
  declare(getOperation(), thread, {pointer});
  auto call = declare(getOperation(), "pikoir_grid_launch",
                      {pointer, pointer, i64, i64, pointer, i64});
  auto toI64 = [&](Value index) {
    return arith::IndexCastOp::create(builder, loc, i64, index).getResult();
  };
  LLVM::CallOp::create(
      builder, loc, call,
      ValueRange{function.getArgument(0),
                 LLVM::AddressOfOp::create(builder, loc, pointer, thread),
                 toI64(launch.getGridSizeX()), toI64(launch.getBlockSizeX()),
                 arguments,
                 LLVM::ConstantOp::create(builder, loc,
                                          builder.getI64IntegerAttr(seed))});
  launch.erase();
  return success();
}

void ConvertGPUToEmulatorPass::runOnOperation() {
  SmallVector<gpu::LaunchFuncOp> launches;
  getOperation().walk(
      [&](gpu::LaunchFuncOp launch) { launches.push_back(launch); });
  for (gpu::LaunchFuncOp launch : launches)
    if (failed(convert(launch)))
      return signalPassFailure();
  getOperation()->removeAttr(gpu::GPUDialect::getContainerModuleAttrName());
}
