// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// convert-gpu-to-emulator: launches as calls of the emulator.

#include "GPULaunch/LaunchCall.h"

#include "Piko/Conversion/Emulation.h"
#include "Piko/Conversion/Passes.h"
#include "Piko/Dialect/Piko/IR/Marks.h"

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

LogicalResult ConvertGPUToEmulatorPass::convert(gpu::LaunchFuncOp launch) {
  FailureOr<LaunchCall> call = createLaunchCall(launch);
  if (failed(call))
    return failure();
  OpBuilder builder(launch);
  Location loc = launch.getLoc();
  Type pointer = LLVM::LLVMPointerType::get(&getContext());
  Type i64 = builder.getI64Type();
  std::string thread = getEmulatedName(launch.getKernelModuleName().getValue(),
                                       launch.getKernelName().getValue());
  declareFunction(getOperation(), thread, {pointer});
  auto callee = declareFunction(getOperation(), "pikoir_grid_launch",
                                {pointer, pointer, i64, i64, pointer, i64});
  Value grid = call->blocks;
  if (blocks > 0)
    grid = arith::MinSIOp::create(
        builder, loc, grid,
        arith::ConstantIntOp::create(builder, loc, blocks, 64));
  LLVM::CallOp::create(
      builder, loc, callee,
      ValueRange{call->pipeline,
                 LLVM::AddressOfOp::create(builder, loc, pointer, thread), grid,
                 call->threads, call->arguments,
                 LLVM::ConstantOp::create(builder, loc,
                                          builder.getI64IntegerAttr(seed))});
  return success();
}

void ConvertGPUToEmulatorPass::runOnOperation() {
  // It runs a grid when the host launches it.
  for (Operation &op : *getOperation().getBody())
    op.removeAttr(marks::steps);
  if (failed(convertLaunches(getOperation(), [&](gpu::LaunchFuncOp launch) {
        return convert(launch);
      })))
    signalPassFailure();
}
