// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Images that threads have for themselves: declared to the runtime, with a
// function for each selection that combines those of two threads.

#include "PikoToLLVM/KernelLowering.h"

#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/Dialect/SCF/IR/SCF.h"

using namespace mlir;
using namespace piko;

namespace {

/// Writes a pikoir_select.
class SelectWriter {
public:
  SelectWriter(PipelineOp pipeline, const ImageSelection &selection,
               LoweringContext &context);
  LLVM::LLVMFuncOp write();

private:
  /// A number of a pixel's.
  struct Number {
    Type type;
    int64_t offset;
  };
  /// Pixel by pixel, those of one thread.
  struct Pixels {
    SmallVector<Value> images; ///< Their first pixels.
    Value units;
  };
  Pixels loadPointers(Value array);
  Value getAddress(Value first, Value pixel, int64_t size, int64_t offset = 0);
  Value load(Type type, Value address) {
    return createLoad(builder, loc, type, address, /*tag=*/nullptr);
  }
  Value compare(StringRef predicate, Value a, Value b);
  /// Whether `a` is before `b` by the key.
  Value isBefore(ArrayRef<Value> a, ArrayRef<Value> b);
  SmallVector<Value> loadKey(Value first, Value pixel);
  Value isSelected(const Pixels &to, const Pixels &from, Value pixel,
                   Value unit, Value other);
  void copy(const Pixels &to, const Pixels &from, Value pixel);
  Number getNumber(size_t image, int64_t number) {
    return {records[image].getElementTypes()[number],
            records[image].getElementOffsets()[number]};
  }

  const ImageSelection &selection;
  OpBuilder builder;
  Location loc;
  LLVM::LLVMFuncOp function;
  SmallVector<RecordOp> records; ///< Of the images.
};

} // namespace

SelectWriter::SelectWriter(PipelineOp pipeline, const ImageSelection &selection,
                           LoweringContext &context)
    : selection(selection),
      builder(OpBuilder::atBlockEnd(
          pipeline->getParentOfType<ModuleOp>().getBody())),
      loc(pipeline.getLoc()) {
  auto pointer = LLVM::LLVMPointerType::get(builder.getContext());
  auto type = LLVM::LLVMFunctionType::get(
      LLVM::LLVMVoidType::get(builder.getContext()),
      {pointer, pointer, builder.getI64Type(), builder.getI64Type()});
  std::string name =
      (pipeline.getSymName() + ".select." + selection.stage.getValue() + "." +
       selection.unitImage.getValue())
          .str();
  function = LLVM::LLVMFuncOp::create(builder, loc, name, type,
                                      LLVM::Linkage::Internal);
  for (StringAttr image : selection.images)
    records.push_back(context.record(
        getStateRecord(SymbolTable::lookupSymbolIn(pipeline, image))));
}

SelectWriter::Pixels SelectWriter::loadPointers(Value array) {
  Pixels pixels;
  auto pointer = LLVM::LLVMPointerType::get(builder.getContext());
  for (size_t i = 0; i <= selection.images.size(); ++i)
    pixels.images.push_back(
        load(pointer,
             createOffset(builder, loc, array, int64_t(i * sizeof(void *)))));
  pixels.units = pixels.images.pop_back_val();
  return pixels;
}

Value SelectWriter::getAddress(Value first, Value pixel, int64_t size,
                               int64_t offset) {
  Value bytes =
      arith::MulIOp::create(builder, loc, pixel, createI64(builder, loc, size));
  return createOffset(builder, loc, createOffset(builder, loc, first, bytes),
                      offset);
}

Value SelectWriter::compare(StringRef predicate, Value a, Value b) {
  if (isa<FloatType>(a.getType()))
    return arith::CmpFOp::create(
        builder, loc, *arith::symbolizeCmpFPredicate(predicate), a, b);
  return arith::CmpIOp::create(builder, loc,
                               *arith::symbolizeCmpIPredicate(predicate), a, b);
}

Value SelectWriter::isBefore(ArrayRef<Value> a, ArrayRef<Value> b) {
  Value result =
      arith::ConstantOp::create(builder, loc, builder.getBoolAttr(false));
  auto comparisons =
      llvm::to_vector(selection.comparisons.getAsRange<StringAttr>());
  for (size_t i = a.size(); i-- > 0;) {
    StringRef equal = isa<FloatType>(a[i].getType()) ? "oeq" : "eq";
    Value rest =
        arith::AndIOp::create(builder, loc, compare(equal, a[i], b[i]), result);
    result = arith::OrIOp::create(builder, loc,
                                  compare(comparisons[i], a[i], b[i]), rest);
  }
  return result;
}

SmallVector<Value> SelectWriter::loadKey(Value first, Value pixel) {
  SmallVector<Value> key;
  for (int64_t number : selection.numbers.asArrayRef()) {
    auto [type, offset] = getNumber(0, number);
    key.push_back(load(
        type, getAddress(first, pixel, records.front().getSize(), offset)));
  }
  return key;
}

/// Whether the pixel of `from`, which is of `unit`, comes before that of `to`,
/// which is of `other`, or of none.
Value SelectWriter::isSelected(const Pixels &to, const Pixels &from,
                               Value pixel, Value unit, Value other) {
  SmallVector<Value> ours = loadKey(to.images.front(), pixel),
                     theirs = loadKey(from.images.front(), pixel);
  Value none = createI32(builder, loc, -1);
  Value isNone = compare("eq", other, none);
  Value isLater = isBefore(ours, theirs);
  Value isInOrder = compare(selection.last ? "sgt" : "slt", unit, other);
  Value yes =
      arith::ConstantOp::create(builder, loc, builder.getBoolAttr(true));
  Value isTie = arith::AndIOp::create(
      builder, loc, arith::XOrIOp::create(builder, loc, isLater, yes),
      isInOrder);
  return arith::OrIOp::create(
      builder, loc, isNone,
      arith::OrIOp::create(builder, loc, isBefore(theirs, ours), isTie));
}

void SelectWriter::copy(const Pixels &to, const Pixels &from, Value pixel) {
  for (auto [i, kept] :
       llvm::enumerate(selection.kept.getAsRange<DenseI64ArrayAttr>()))
    for (int64_t number : kept.asArrayRef()) {
      auto [type, offset] = getNumber(i, number);
      int64_t size = records[i].getSize();
      Value value = load(type, getAddress(from.images[i], pixel, size, offset));
      createStore(builder, loc, value,
                  getAddress(to.images[i], pixel, size, offset),
                  /*tag=*/nullptr);
    }
}

LLVM::LLVMFuncOp SelectWriter::write() {
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToEnd(function.addEntryBlock(builder));
  Pixels to = loadPointers(function.getArgument(0)),
         from = loadPointers(function.getArgument(1));
  Value one = arith::ConstantIndexOp::create(builder, loc, 1);
  auto loop = scf::ForOp::create(
      builder, loc, toIndex(builder, loc, function.getArgument(2)),
      toIndex(builder, loc, function.getArgument(3)), one);
  LLVM::ReturnOp::create(builder, loc, ValueRange());
  builder.setInsertionPoint(loop.getBody()->getTerminator());
  Value pixel = toI64(builder, loc, loop.getInductionVar());
  constexpr int64_t size = sizeof(int32_t);
  Type i32 = builder.getI32Type();
  Value unit = load(i32, getAddress(from.units, pixel, size));
  Value isChanged = compare("ne", unit, createI32(builder, loc, -1));
  auto branch = scf::IfOp::create(builder, loc, isChanged, /*withElse=*/false);
  builder.setInsertionPointToStart(branch.thenBlock());
  Value at = getAddress(to.units, pixel, size);
  Value other = load(i32, at);
  auto choice =
      scf::IfOp::create(builder, loc, isSelected(to, from, pixel, unit, other),
                        /*withElse=*/false);
  builder.setInsertionPointToStart(choice.thenBlock());
  copy(to, from, pixel);
  createStore(builder, loc, unit, at, /*tag=*/nullptr);
  return function;
}

void piko::declareSelections(OpBuilder &builder, Value frame,
                             const PipelineNumbers &numbers,
                             LoweringContext &context) {
  PipelineOp pipeline = numbers.pipeline;
  Location loc = pipeline.getLoc();
  auto i32 = [&](int64_t v) { return createI32(builder, loc, v); };
  for (const ImageSelection &selection : numbers.selections) {
    LLVM::LLVMFuncOp select =
        SelectWriter(pipeline, selection, context).write();
    auto states = llvm::map_to_vector(selection.images, [&](StringAttr image) {
      return static_cast<int32_t>(numbers.states.lookup(image));
    });
    context.call(
        builder, loc, PIKO_RUNTIME_FUNCTION(pikoir_declare_selection),
        {frame, i32(numbers.stages.lookup(selection.stage)),
         i32(*numbers.findSelection(selection.stage, selection.unitImage)),
         context.array(builder, loc, states), i32(selection.images.size()),
         i32(selection.often),
         LLVM::AddressOfOp::create(builder, loc, select)});
  }
}

namespace {

struct PrivateImagesLowering : Lowering<PrivateImagesOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(PrivateImagesOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    const PipelineNumbers &numbers = context.numbers(op);
    FailureOr<StringAttr> stage = context.kernelStage(op);
    if (failed(stage))
      return failure();
    std::optional<int32_t> selection =
        numbers.findSelection(*stage, op.getUnitImageAttr().getAttr());
    assert(selection && "the pipeline's selections have numbers");
    Value images =
        context
            .call(rewriter, loc, PIKO_RUNTIME_FUNCTION(pikoir_get_images),
                  {adaptor.getWriter(), createI32(rewriter, loc, *selection)})
            .getResult();
    SmallVector<StringAttr> names = op.getImages();
    names.push_back(op.getUnitImageAttr().getAttr());
    Value data;
    for (auto [i, name] : llvm::enumerate(names)) {
      auto offset = static_cast<int64_t>(i * sizeof(void *));
      data = createLoad(rewriter, loc, pointer(rewriter),
                        createOffset(rewriter, loc, images, offset),
                        context.tags.input());
      context.setData(rewriter, op, name, names.front(), data);
    }
    Value null = LLVM::ZeroOp::create(rewriter, loc, data.getType());
    rewriter.replaceOpWithNewOp<LLVM::ICmpOp>(op, LLVM::ICmpPredicate::ne, data,
                                              null);
    return success();
  }
};

} // namespace

void piko::populateSelectionsToLLVMPatterns(const TypeConverter &converter,
                                            RewritePatternSet &patterns,
                                            LoweringContext &context) {
  patterns.add<PrivateImagesLowering>(converter, patterns.getContext(),
                                      context);
}
