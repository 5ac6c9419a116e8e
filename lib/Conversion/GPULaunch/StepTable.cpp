// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A step that runs a kernel names its grids, an array that ends with one
// without a name. The function of a grid computes its arguments as the kernel's
// own does, from what a call gives it for input and log.

#include "GPULaunch/StepTable.h"

#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/Piko.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/IR/IRMapping.h"
#include "mlir/Interfaces/CallInterfaces.h"

using namespace mlir;
using namespace piko;

namespace {

/// Writes the function of one grid.
class ArgumentWriter {
public:
  ArgumentWriter(gpu::LaunchFuncOp launch, StringRef name);
  FailureOr<LLVM::LLVMFuncOp> run();

private:
  /// The value in the function of a grid; null, and an error, if there is none.
  Value copy(Value value);
  Value copyResult(OpResult result);

  gpu::LaunchFuncOp launch;
  OpBuilder builder;
  LLVM::LLVMFuncOp function;
  IRMapping copies;
};

/// Writes the table of one pipeline.
class TableWriter {
public:
  TableWriter(FunctionOpInterface setup, KernelNamer nameKernel)
      : setup(setup), module(setup->getParentOfType<ModuleOp>()),
        context(setup.getContext()), loc(setup.getLoc()),
        nameKernel(nameKernel) {}
  LogicalResult run(OpBuilder &builder);

private:
  LogicalResult createGrids(FlatSymbolRefAttr kernel);
  LogicalResult createHostCall(FlatSymbolRefAttr kernel);
  /// What a step names, in the table.
  StringRef getSuffix(StepAttr step) const {
    return step.getKind() == StepKind::Host ? ".host" : ".grids";
  }
  /// A constant array of structures, whose members `write` inserts.
  void
  createArray(StringRef name, Type element, size_t count,
              llvm::function_ref<Value(OpBuilder &, Value, int64_t)> write);
  Value insert(OpBuilder &builder, Value into, int64_t member, Value value) {
    return LLVM::InsertValueOp::create(builder, loc, into, value, member);
  }

  FunctionOpInterface setup;
  ModuleOp module;
  MLIRContext *context;
  Location loc;
  KernelNamer nameKernel;
};

} // namespace

//===----------------------------------------------------------------------===//
// The arguments of a grid
//===----------------------------------------------------------------------===//

ArgumentWriter::ArgumentWriter(gpu::LaunchFuncOp launch, StringRef name)
    : launch(launch),
      builder(launch->getParentOfType<ModuleOp>().getBody(),
              launch->getParentOfType<ModuleOp>().getBody()->end()) {
  Type pointer = LLVM::LLVMPointerType::get(launch.getContext());
  function = LLVM::LLVMFuncOp::create(
      builder, launch.getLoc(), name,
      LLVM::LLVMFunctionType::get(LLVM::LLVMVoidType::get(launch.getContext()),
                                  {pointer, pointer, pointer, pointer}),
      LLVM::Linkage::Internal);
  builder.setInsertionPointToStart(function.addEntryBlock(builder));
}

/// Whether a function of the runtime's answers the same before a run and in it.
static bool saysWhatTheHostHas(StringRef name) {
  return llvm::is_contained({"pikoir_get_state", "pikoir_get_source",
                             "pikoir_domain", "pikoir_grid", "pikoir_tile_grid",
                             "pikoir_loop_limit"},
                            name);
}

Value ArgumentWriter::copyResult(OpResult result) {
  Operation *op = result.getOwner();
  if (auto call = dyn_cast<CallOpInterface>(op)) {
    auto callee = dyn_cast<SymbolRefAttr>(call.getCallableForCallee());
    StringRef name = callee ? callee.getLeafReference().getValue() : "";
    if (name == "pikoir_begin" || name == "pikoir_begin_source")
      return function.getArgument(1);
    if (name == "pikoir_log_open")
      return function.getArgument(2);
    if (name.starts_with("pikoir_") && !saysWhatTheHostHas(name)) {
      launch.emitError("expected arguments that follow from the pipeline's "
                       "state, but got one of what '")
          << name << "' says, which only a run on the host knows";
      return {};
    }
  }
  if (op->getNumRegions() > 0) {
    launch.emitError("expected arguments that follow from the pipeline's state "
                     "without branches")
            .attachNote(op->getLoc())
        << "but got this";
    return {};
  }
  for (Value operand : op->getOperands())
    if (!copy(operand))
      return {};
  builder.clone(*op, copies);
  return copies.lookup(result);
}

Value ArgumentWriter::copy(Value value) {
  if (Value known = copies.lookupOrNull(value))
    return known;
  Value made;
  auto outer = launch->getParentOfType<FunctionOpInterface>();
  if (auto result = dyn_cast<OpResult>(value))
    made = copyResult(result);
  else if (value == outer.getArgument(0))
    made = function.getArgument(0);
  else
    launch.emitError(
        "expected arguments that follow from the pipeline's state, "
        "but got one that branches carry");
  if (made)
    copies.map(value, made);
  return made;
}

FailureOr<LLVM::LLVMFuncOp> ArgumentWriter::run() {
  SmallVector<Value> arguments;
  for (Value operand : launch.getKernelOperands()) {
    Value argument = copy(operand);
    if (!argument)
      return failure();
    arguments.push_back(argument);
  }
  if (failed(
          storeArguments(builder, launch, arguments, function.getArgument(3))))
    return failure();
  LLVM::ReturnOp::create(builder, launch.getLoc(), ValueRange());
  return function;
}

//===----------------------------------------------------------------------===//
// The table
//===----------------------------------------------------------------------===//

void TableWriter::createArray(
    StringRef name, Type element, size_t count,
    llvm::function_ref<Value(OpBuilder &, Value, int64_t)> write) {
  OpBuilder builder(module.getBody(), module.getBody()->end());
  auto type = LLVM::LLVMArrayType::get(element, count);
  auto global =
      LLVM::GlobalOp::create(builder, loc, type, /*isConstant=*/true,
                             LLVM::Linkage::Internal, name, Attribute());
  builder.createBlock(&global.getInitializerRegion());
  Value all = LLVM::ZeroOp::create(builder, loc, type);
  for (int64_t i = 0; i < int64_t(count); ++i)
    all =
        insert(builder, all, i,
               write(builder, LLVM::ZeroOp::create(builder, loc, element), i));
  LLVM::ReturnOp::create(builder, loc, all);
}

LogicalResult TableWriter::createGrids(FlatSymbolRefAttr kernel) {
  std::string all = (kernel.getValue() + ".grids").str();
  if (module.lookupSymbol(all))
    return success(); // of a step before
  Operation *function = module.lookupSymbol(kernel.getAttr());
  if (!function)
    return setup->emitError("expected a function ")
           << kernel << ", which a step names";
  SmallVector<gpu::LaunchFuncOp> launches;
  function->walk([&](gpu::LaunchFuncOp op) { launches.push_back(op); });
  SmallVector<LLVM::LLVMFuncOp> functions;
  for (gpu::LaunchFuncOp launch : launches) {
    std::string name =
        (kernel.getValue() + ".arguments" + Twine(functions.size())).str();
    FailureOr<LLVM::LLVMFuncOp> written = ArgumentWriter(launch, name).run();
    if (failed(written))
      return failure();
    if (!getConstantIntValue(launch.getBlockSizeX()))
      return launch.emitError("expected blocks of a constant size");
    functions.push_back(*written);
  }
  Type pointer = LLVM::LLVMPointerType::get(context);
  Type i64 = IntegerType::get(context, 64);
  auto grid =
      LLVM::LLVMStructType::getLiteral(context, {pointer, i64, i64, pointer});
  createArray(
      all, grid, launches.size() + 1,
      [&](OpBuilder &builder, Value zero, int64_t i) {
        if (i == int64_t(launches.size()))
          return zero;
        auto number = [&](int64_t value) {
          return LLVM::ConstantOp::create(builder, loc, i64, value);
        };
        gpu::LaunchFuncOp launch = launches[i];
        Value made = insert(builder, zero, 0, nameKernel(builder, launch));
        made = insert(builder, made, 1,
                      number(*getConstantIntValue(launch.getBlockSizeX())));
        made = insert(builder, made, 2, number(launch.getNumKernelOperands()));
        return insert(builder, made, 3,
                      LLVM::AddressOfOp::create(builder, loc, functions[i]));
      });
  return success();
}

/// A function of the LLVM dialect, which alone has an address.
LogicalResult TableWriter::createHostCall(FlatSymbolRefAttr kernel) {
  auto function = module.lookupSymbol<func::FuncOp>(kernel.getAttr());
  if (!function)
    return setup->emitError("expected a function ")
           << kernel << ", which a step names";
  std::string name = (kernel.getValue() + ".host").str();
  if (module.lookupSymbol(name))
    return success();
  OpBuilder builder(module.getBody(), module.getBody()->end());
  auto host = LLVM::LLVMFuncOp::create(
      builder, function.getLoc(), name,
      LLVM::LLVMFunctionType::get(IntegerType::get(context, 32),
                                  LLVM::LLVMPointerType::get(context)),
      LLVM::Linkage::Internal);
  builder.setInsertionPointToStart(host.addEntryBlock(builder));
  auto call = func::CallOp::create(builder, function.getLoc(), function,
                                   host.getArgument(0));
  LLVM::ReturnOp::create(builder, function.getLoc(), call.getResults());
  return success();
}

LogicalResult TableWriter::run(OpBuilder &builder) {
  auto steps = dyn_cast_or_null<ArrayAttr>(setup->removeAttr(marks::steps));
  if (!steps)
    return success();
  for (auto step : steps.getAsRange<StepAttr>())
    if (step.getKernel() && failed(step.getKind() == StepKind::Host
                                       ? createHostCall(step.getKernel())
                                       : createGrids(step.getKernel())))
      return failure();
  Type pointer = LLVM::LLVMPointerType::get(context);
  Type i32 = IntegerType::get(context, 32), i64 = IntegerType::get(context, 64);
  auto element = LLVM::LLVMStructType::getLiteral(
      context, {i32, i32, i32, i32, pointer, pointer});
  StringRef pipeline = setup.getName();
  pipeline.consume_back(".setup");
  std::string name = (pipeline + ".steps").str();
  createArray(
      name, element, steps.size(), [&](OpBuilder &at, Value made, int64_t i) {
        auto step = cast<StepAttr>(steps[i]);
        int32_t numbers[] = {int32_t(step.getKind()), step.getNumber(),
                             step.getMember(), step.getExit()};
        for (auto [member, number] : llvm::enumerate(numbers))
          made = insert(at, made, int64_t(member),
                        LLVM::ConstantOp::create(at, loc, i32, number));
        if (FlatSymbolRefAttr kernel = step.getKernel())
          made = insert(at, made, step.getKind() == StepKind::Host ? 5 : 4,
                        LLVM::AddressOfOp::create(
                            at, loc, pointer,
                            (kernel.getValue() + getSuffix(step)).str()));
        return made;
      });
  auto callee =
      declareFunction(module, "pikoir_cuda_program", {pointer, pointer, i64});
  LLVM::CallOp::create(
      builder, loc, callee,
      ValueRange{setup.getArgument(0),
                 LLVM::AddressOfOp::create(builder, loc, pointer, name),
                 LLVM::ConstantOp::create(builder, loc, i64, steps.size())});
  return success();
}

LogicalResult piko::createStepTable(FunctionOpInterface setup,
                                    OpBuilder &builder,
                                    KernelNamer nameKernel) {
  return TableWriter(setup, nameKernel).run(builder);
}
