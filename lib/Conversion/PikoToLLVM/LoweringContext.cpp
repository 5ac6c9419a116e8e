// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the patterns of convert-piko-to-llvm share.

#include "PikoToLLVM/LoweringContext.h"

#include "Piko/Analysis/StageGraph.h"
#include "Piko/Analysis/TargetModel.h"
#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Conversion/LLVMCommon/MemRefBuilder.h"
#include "mlir/Conversion/LLVMCommon/TypeConverter.h"
#include "mlir/Dialect/GPU/IR/GPUDialect.h"

using namespace mlir;
using namespace piko;

Type piko::convertType(MLIRContext *context, ABIType type) {
  switch (type) {
  case ABIType::None:
    return LLVM::LLVMVoidType::get(context);
  case ABIType::I32:
    return IntegerType::get(context, 32);
  case ABIType::I64:
    return IntegerType::get(context, 64);
  case ABIType::Address:
    return LLVM::LLVMPointerType::get(context);
  }
  llvm_unreachable("a type of the runtime's");
}

PipelineNumbers::PipelineNumbers(PipelineOp pipeline) : pipeline(pipeline) {
  for (StageOp stage : getDeclaredStages(pipeline))
    stages[stage.getSymNameAttr()] = stages.size();
  for (auto record : pipeline->getParentOfType<ModuleOp>().getOps<RecordOp>())
    records[record.getSymNameAttr()] = records.size();
  numberStates();
  pipeline.walk([&](StateAccessOpInterface access) {
    FlatSymbolRefAttr state = access.getAccessedState();
    if (access.getAccessKinds() != StateAccess::reads &&
        isa<BufferOp>(SymbolTable::lookupSymbolIn(pipeline, state.getAttr())))
      writtenBuffers.insert(state.getAttr());
  });
  for (auto buffer : pipeline.getOps<BufferOp>())
    if (SymbolTable::symbolKnownUseEmpty(buffer, &pipeline.getBody()))
      unusedBuffers.insert(buffer.getSymNameAttr());
  pipeline.walk([&](PrivateCopyOp copy) {
    StageOp stage = getKernelStage(copy);
    if (!stage)
      return;
    Reduction reduction{stage.getSymNameAttr(), copy.getStateAttr().getAttr(),
                        copy.getFieldAttr(), copy.getKind(), copy.getOften()};
    if (!findReduction(reduction.stage, reduction.state, reduction.field))
      reductions.push_back(reduction);
  });
  pipeline.walk([&](PrivateImagesOp op) {
    if (StageOp stage = getKernelStage(op))
      selections.push_back({stage.getSymNameAttr(),
                            op.getUnitImageAttr().getAttr(), op.getImages(),
                            op.getNumbersAttr(), op.getComparisonsAttr(),
                            op.getKeptAttr(), op.getLast(), op.getOften()});
  });
}

/// What is internal comes after what the host knows.
void PipelineNumbers::numberStates() {
  llvm::DenseSet<StringAttr> ofThreads;
  pipeline.walk([&](PrivateImagesOp op) {
    ofThreads.insert(op.getUnitImageAttr().getAttr());
  });
  for (bool internal : {false, true})
    for (Operation &op : *pipeline.getBodyBlock()) {
      auto image = dyn_cast<ImageOp>(op);
      bool isInternal = image && image.getInternal();
      StringAttr name = SymbolTable::getSymbolName(&op);
      if (getStateRecord(&op) && isInternal == internal &&
          !ofThreads.contains(name))
        states[name] = states.size();
    }
}

std::optional<int32_t> PipelineNumbers::findReduction(StringAttr stage,
                                                      StringAttr state,
                                                      StringRef field) const {
  int32_t number = 0;
  for (const Reduction &reduction : reductions) {
    if (reduction.stage != stage)
      continue;
    if (reduction.state == state && reduction.field == field)
      return number;
    ++number;
  }
  return std::nullopt;
}

std::optional<int32_t>
PipelineNumbers::findSelection(StringAttr stage, StringAttr unitImage) const {
  int32_t number = 0;
  for (const ImageSelection &selection : selections) {
    if (selection.stage != stage)
      continue;
    if (selection.unitImage == unitImage)
      return number;
    ++number;
  }
  return std::nullopt;
}

std::string piko::getFunctionName(KernelOp kernel) {
  return (getPipeline(kernel).getSymName() + "." + kernel.getSymName()).str();
}

func::FuncOp LoweringContext::outline(KernelOp kernel,
                                      const PipelineNumbers &numbers) {
  OpBuilder builder(module.getBodyRegion());
  builder.setInsertionPointToEnd(module.getBody());
  Location loc = kernel.getLoc();
  auto type = builder.getFunctionType(
      LLVM::LLVMPointerType::get(builder.getContext()), builder.getI32Type());
  auto function =
      func::FuncOp::create(builder, loc, getFunctionName(kernel), type);
  function.setPrivate();
  function.getBody().takeBody(kernel.getBody());
  Block &entry = function.getBody().front();
  entry.addArgument(type.getInput(0), loc);
  builder.setInsertionPointToEnd(&entry);
  func::ReturnOp::create(builder, loc, createI32(builder, loc, 0));
  functions[function] = &numbers;
  return function;
}

const PipelineNumbers &LoweringContext::numbers(Operation *op) const {
  return *functions.at(op->getParentOfType<func::FuncOp>());
}

int32_t LoweringContext::stageNumber(Operation *op, StringRef stage) const {
  return numbers(op).stages.lookup(StringAttr::get(op->getContext(), stage));
}

StageOp LoweringContext::stage(Operation *op, FlatSymbolRefAttr name) const {
  return lookupInPipeline<StageOp>(numbers(op).pipeline, name);
}

Operation *LoweringContext::state(Operation *op, StringRef name) const {
  return SymbolTable::lookupSymbolIn(numbers(op).pipeline, name);
}

RecordOp LoweringContext::record(FlatSymbolRefAttr name) const {
  return ModuleOp(module).lookupSymbol<RecordOp>(name);
}

Value LoweringContext::frame(Operation *op) const {
  return op->getParentOfType<func::FuncOp>().getArgument(0);
}

GridContext *LoweringContext::grid(Operation *op) {
  auto launch = op->getParentOfType<gpu::LaunchOp>();
  auto found = grids.find(launch);
  return launch && found != grids.end() ? &found->second : nullptr;
}

void LoweringContext::noteGrid(Operation *inside, GridContext grid) {
  grids[inside->getParentOfType<gpu::LaunchOp>()] = grid;
}

int32_t LoweringContext::nextPlace(Operation *launch) {
  return places[launch->getParentOfType<func::FuncOp>()]++;
}

StateView &LoweringContext::view(OpBuilder &builder, Operation *op,
                                 StringRef state) {
  auto function = op->getParentOfType<func::FuncOp>();
  auto [it, fresh] = views[function].try_emplace(state);
  if (!fresh)
    return it->second;
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(&function.getBody().front());
  Location loc = function.getLoc();
  auto pointer = LLVM::LLVMPointerType::get(builder.getContext());
  int32_t number =
      numbers(op).states.lookup(StringAttr::get(op->getContext(), state));
  Value view = call(builder, loc, PIKO_RUNTIME_FUNCTION(pikoir_get_state),
                    {frame(op), createI32(builder, loc, number)})
                   .getResult();
  auto data = PIKO_RUNTIME_MEMBER(pikoir_state, data);
  it->second.data = LLVM::LoadOp::create(
      builder, loc, pointer, createOffset(builder, loc, view, data.offset));
  constexpr int64_t extent = offsetof(pikoir_state, extent);
  for (int64_t dim = 0; dim < 4; ++dim)
    it->second.extents.push_back(LLVM::LoadOp::create(
        builder, loc, builder.getI64Type(),
        createOffset(builder, loc, view, extent + 8 * dim)));
  it->second.pitch = it->second.extents.front();
  return it->second;
}

FailureOr<StringAttr> LoweringContext::kernelStage(Operation *op) const {
  auto function = op->getParentOfType<func::FuncOp>();
  auto number = function->getAttrOfType<IntegerAttr>(marks::number);
  if (!number) {
    op->emitError("expected a kernel over the bins of a stage");
    return failure();
  }
  return (numbers(op).stages.begin() + number.getInt())->first;
}

void LoweringContext::setData(OpBuilder &builder, Operation *op,
                              StringRef image, StringRef like, Value data) {
  StateView other = view(builder, op, like);
  other.data = data;
  views[op->getParentOfType<func::FuncOp>()][image] = other;
}

const StateView &LoweringContext::whole(OpBuilder &builder, Operation *op,
                                        StringRef image) {
  const StateView &first = view(builder, op, image);
  return wholes[op->getParentOfType<func::FuncOp>()]
      .try_emplace(image, first)
      .first->second;
}

void LoweringContext::setTile(Operation *op, StringRef image, Value data,
                              Value pitch) {
  StateView &view = views[op->getParentOfType<func::FuncOp>()][image];
  view.data = data;
  view.pitch = pitch;
}

Value LoweringContext::tileLeast(OpBuilder &builder, Operation *op,
                                 int32_t stage, int32_t image) {
  auto parent = op->getParentOfType<func::FuncOp>();
  constexpr RuntimeFunction function = PIKO_RUNTIME_FUNCTION(pikoir_tile_least);
  Value &known =
      queries[parent]
             [(function.name + "/" + Twine(stage) + "/" + Twine(image)).str()];
  if (known)
    return known;
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(&parent.getBody().front());
  Location loc = parent.getLoc();
  return known = call(builder, loc, function,
                      {frame(op), createI32(builder, loc, stage),
                       createI32(builder, loc, image)})
                     .getResult();
}

Value LoweringContext::query(OpBuilder &builder, Operation *op,
                             const RuntimeFunction &function,
                             std::optional<int32_t> stage, int64_t dim) {
  auto parent = op->getParentOfType<func::FuncOp>();
  std::string key =
      (function.name + "/" + Twine(stage.value_or(-1)) + "/" + Twine(dim))
          .str();
  Value &known = queries[parent][key];
  if (known)
    return known;
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(&parent.getBody().front());
  Location loc = parent.getLoc();
  SmallVector<Value> arguments{frame(op)};
  if (stage)
    arguments.push_back(createI32(builder, loc, *stage));
  Value entries = call(builder, loc, function, arguments).getResult();
  return known =
             LLVM::LoadOp::create(builder, loc, builder.getI64Type(),
                                  createOffset(builder, loc, entries, 8 * dim));
}

/// The launch that is to load members of bins that are opened outside: where a
/// device makes them, the host does not know them when it launches.
static gpu::LaunchOp findGridLaunch(OpBuilder &builder, Value bins) {
  Operation *parent = builder.getInsertionBlock()->getParentOp();
  auto launch = dyn_cast<gpu::LaunchOp>(parent);
  if (!launch)
    launch = parent->getParentOfType<gpu::LaunchOp>();
  bool isInside = launch && launch.getBody().isAncestor(bins.getParentRegion());
  return isInside ? gpu::LaunchOp() : launch;
}

Value LoweringContext::member(OpBuilder &builder, Value bins,
                              const RuntimeMember &which) {
  gpu::LaunchOp launch = findGridLaunch(builder, bins);
  Value &known = members[{bins, launch, which.offset}];
  if (known)
    return known;
  OpBuilder::InsertionGuard guard(builder);
  if (launch)
    builder.setInsertionPointToStart(&launch.getBody().front());
  else
    builder.setInsertionPointAfterValue(bins);
  Location loc = bins.getLoc();
  known =
      createLoad(builder, loc, convertType(bins.getContext(), which.type),
                 createOffset(builder, loc, bins, which.offset), tags.input());
  if (launch)
    known.getDefiningOp()->setAttr(marks::input, builder.getUnitAttr());
  return known;
}

LLVM::CallOp LoweringContext::call(OpBuilder &builder, Location loc,
                                   const RuntimeFunction &function,
                                   ValueRange arguments) {
  assert(arguments.size() == function.count && "as in pikort/abi.h");
  LLVM::LLVMFuncOp &callee = called[function.name];
  if (!callee) {
    OpBuilder::InsertionGuard guard(builder);
    builder.setInsertionPointToStart(module.getBody());
    SmallVector<Type> parameters;
    for (ABIType type :
         ArrayRef(function.parameters).take_front(function.count))
      parameters.push_back(convertType(builder.getContext(), type));
    callee = LLVM::LLVMFuncOp::create(
        builder, loc, function.name,
        LLVM::LLVMFunctionType::get(
            convertType(builder.getContext(), function.result), parameters));
    if (isFailure(function.name))
      callee.setPassthroughAttr(
          builder.getArrayAttr(builder.getStringAttr("cold")));
  }
  auto call = LLVM::CallOp::create(builder, loc, callee, arguments);
  if (ArrayAttr tag = tags.call(function.name))
    call.setTbaaAttr(tag);
  return call;
}

Value LoweringContext::test(OpBuilder &builder, Location loc,
                            const RuntimeFunction &function,
                            ValueRange arguments) {
  Value result = call(builder, loc, function, arguments).getResult();
  return arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::ne, result,
                               createI32(builder, loc, 0));
}

LLVM::LLVMFuncOp LoweringContext::pureFunction(OpBuilder &builder,
                                               StringRef name,
                                               LLVM::LLVMFunctionType type) {
  if (auto known = module.lookupSymbol<LLVM::LLVMFuncOp>(name))
    return known;
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(module.getBody());
  auto function =
      LLVM::LLVMFuncOp::create(builder, module.getLoc(), name, type);
  constexpr auto none = LLVM::ModRefInfo::NoModRef;
  function.setMemoryEffectsAttr(LLVM::MemoryEffectsAttr::get(
      builder.getContext(), {none, none, none, none, none, none}));
  function.setNoUnwind(true);
  function.setWillReturn(true);
  function.setPassthroughAttr(builder.getStrArrayAttr({"speculatable"}));
  return function;
}

StringRef LoweringContext::zeros(int64_t bytes) {
  constexpr StringRef name = "piko.zeros";
  auto zeros = module.lookupSymbol<LLVM::GlobalOp>(name);
  auto size = [&] {
    return cast<LLVM::LLVMArrayType>(zeros.getGlobalType()).getNumElements();
  };
  if (zeros && int64_t(size()) >= bytes)
    return name;
  if (zeros)
    zeros.erase();
  OpBuilder builder(module.getBodyRegion());
  auto type = LLVM::LLVMArrayType::get(builder.getI8Type(), bytes);
  LLVM::GlobalOp::create(
      builder, module.getLoc(), type, /*isConstant=*/true,
      LLVM::Linkage::Internal, name,
      builder.getZeroAttr(RankedTensorType::get(bytes, builder.getI8Type())),
      /*alignment=*/64);
  return name;
}

Value LoweringContext::place(OpBuilder &builder, Operation *op) {
  Location loc = op->getLoc();
  if (auto at = loc->findInstanceOf<FileLineColLoc>())
    return text(
        builder, loc,
        (at.getFilename().getValue() + ":" + Twine(at.getLine())).str());
  return LLVM::ZeroOp::create(builder, loc,
                              LLVM::LLVMPointerType::get(builder.getContext()));
}

Value LoweringContext::array(OpBuilder &builder, Location loc,
                             ArrayRef<int32_t> numbers) {
  OpBuilder atStart(module.getBodyRegion());
  auto global = LLVM::GlobalOp::create(
      atStart, module.getLoc(),
      LLVM::LLVMArrayType::get(builder.getI32Type(), numbers.size()),
      /*isConstant=*/true, LLVM::Linkage::Internal,
      "piko.array." + std::to_string(arrayCount++),
      builder.getI32TensorAttr(numbers));
  return LLVM::AddressOfOp::create(builder, loc, global);
}

Value LoweringContext::text(OpBuilder &builder, Location loc, StringRef text) {
  LLVM::GlobalOp &global = texts[text];
  if (!global) {
    OpBuilder atStart(module.getBodyRegion());
    std::string bytes = (text + StringRef("\0", 1)).str();
    global = LLVM::GlobalOp::create(
        atStart, module.getLoc(),
        LLVM::LLVMArrayType::get(builder.getI8Type(), bytes.size()),
        /*isConstant=*/true, LLVM::Linkage::Internal,
        "piko.text." + std::to_string(texts.size()),
        builder.getStringAttr(bytes));
  }
  return LLVM::AddressOfOp::create(builder, loc, global);
}

Value piko::createLoad(OpBuilder &builder, Location loc, Type type,
                       Value address, ArrayAttr tag) {
  auto load = LLVM::LoadOp::create(builder, loc, type, address);
  load.setTbaaAttr(tag);
  return load;
}

void piko::createStore(OpBuilder &builder, Location loc, Value value,
                       Value address, ArrayAttr tag) {
  LLVM::StoreOp::create(builder, loc, value, address).setTbaaAttr(tag);
}

Value piko::createI32(OpBuilder &builder, Location loc, int64_t v) {
  return arith::ConstantOp::create(builder, loc,
                                   builder.getI32IntegerAttr(int32_t(v)));
}

Value piko::createI64(OpBuilder &builder, Location loc, int64_t v) {
  return arith::ConstantOp::create(builder, loc, builder.getI64IntegerAttr(v));
}

Value piko::toI64(OpBuilder &builder, Location loc, Value v) {
  Type type = builder.getI64Type();
  if (v.getType() == type)
    return v;
  if (v.getType().isIndex())
    return arith::IndexCastOp::create(builder, loc, type, v);
  return arith::ExtSIOp::create(builder, loc, type, v);
}

Value piko::toIndex(OpBuilder &builder, Location loc, Value v) {
  return arith::IndexCastOp::create(builder, loc, builder.getIndexType(), v);
}

Value piko::createBytes(OpBuilder &builder, Location loc, Value pointer,
                        Value size, MemRefType type) {
  // As the conversion of memrefs will see it.
  LLVMTypeConverter types(builder.getContext());
  auto descriptor =
      MemRefDescriptor::poison(builder, loc, types.convertType(type));
  descriptor.setAllocatedPtr(builder, loc, pointer);
  descriptor.setAlignedPtr(builder, loc, pointer);
  descriptor.setConstantOffset(builder, loc, 0);
  descriptor.setSize(builder, loc, 0, size);
  descriptor.setConstantStride(builder, loc, 0, 1);
  return UnrealizedConversionCastOp::create(builder, loc, type,
                                            Value(descriptor))
      .getResult(0);
}

Value piko::createOffset(OpBuilder &builder, Location loc, Value pointer,
                         int64_t bytes) {
  if (bytes == 0)
    return pointer;
  return LLVM::GEPOp::create(
      builder, loc, pointer.getType(), builder.getI8Type(), pointer,
      ArrayRef<LLVM::GEPArg>{int32_t(bytes)}, LLVM::GEPNoWrapFlags::inbounds);
}

Value piko::createOffset(OpBuilder &builder, Location loc, Value pointer,
                         Value bytes) {
  return LLVM::GEPOp::create(
      builder, loc, pointer.getType(), builder.getI8Type(), pointer,
      ArrayRef<LLVM::GEPArg>{bytes}, LLVM::GEPNoWrapFlags::inbounds);
}

void piko::createPrefetch(OpBuilder &builder, Location loc, Value pointer,
                          int64_t bytes) {
  constexpr int32_t read = 0, keep = 3, data = 1;
  constexpr int64_t mostLines = 4;
  auto ask = [&](int64_t offset) {
    Value at = LLVM::GEPOp::create(builder, loc, pointer.getType(),
                                   builder.getI8Type(), pointer,
                                   ArrayRef<LLVM::GEPArg>{int32_t(offset)});
    LLVM::Prefetch::create(builder, loc, at, read, keep, data);
  };
  LLVM::Prefetch::create(builder, loc, pointer, read, keep, data);
  for (int64_t offset = lineSize;
       offset < std::min(bytes - 1, mostLines * lineSize); offset += lineSize)
    ask(offset);
  if (bytes > 1)
    ask(bytes - 1);
}

Value piko::createFieldAddress(OpBuilder &builder, Location loc, Value record,
                               FieldAttr field, ValueRange elements) {
  for (auto [element, stride] : llvm::zip(elements, field.getStrides())) {
    Value bytes =
        arith::MulIOp::create(builder, loc, toI64(builder, loc, element),
                              createI64(builder, loc, stride));
    record = createOffset(builder, loc, record, bytes);
  }
  return createOffset(builder, loc, record, field.getOffset());
}
