// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What kernels reduce to private copies of: declared to the runtime, with a
// function for each that combines a copy with the state.

#include "PikoToLLVM/KernelLowering.h"

#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/Dialect/SCF/IR/SCF.h"

using namespace mlir;
using namespace piko;

Value piko::createChange(OpBuilder &builder, Location loc, AtomicKind kind,
                         Value old, Value value) {
  switch (kind) {
  case AtomicKind::Add:
    return arith::AddIOp::create(builder, loc, old, value);
  case AtomicKind::MinS:
    return arith::MinSIOp::create(builder, loc, old, value);
  case AtomicKind::MaxS:
    return arith::MaxSIOp::create(builder, loc, old, value);
  case AtomicKind::MinU:
    return arith::MinUIOp::create(builder, loc, old, value);
  case AtomicKind::MaxU:
    return arith::MaxUIOp::create(builder, loc, old, value);
  case AtomicKind::And:
    return arith::AndIOp::create(builder, loc, old, value);
  case AtomicKind::Or:
    return arith::OrIOp::create(builder, loc, old, value);
  case AtomicKind::Xor:
    return arith::XOrIOp::create(builder, loc, old, value);
  case AtomicKind::AddF:
    break;
  }
  llvm_unreachable("the verifier of private copies refuses it");
}

/// What changes nothing.
static APInt getIdentity(AtomicKind kind, unsigned bits) {
  switch (kind) {
  case AtomicKind::MinS:
    return APInt::getSignedMaxValue(bits);
  case AtomicKind::MaxS:
    return APInt::getSignedMinValue(bits);
  case AtomicKind::MinU:
  case AtomicKind::And:
    return APInt::getAllOnes(bits);
  default:
    return APInt::getZero(bits);
  }
}

int64_t piko::getRunShift(RecordOp record) {
  // Finer notes take longer to look through, coarser ones combine more for
  // nothing.
  constexpr int64_t bytes = 512;
  int64_t shift = 0;
  while (record.getSize() << shift < bytes)
    ++shift;
  return shift;
}

/// The bytes of a record whose field is the identity, and which is zero
/// elsewhere.
static std::string getIdentityRecord(RecordOp record, FieldAttr field,
                                     AtomicKind kind) {
  std::string bytes(record.getSize(), '\0');
  APInt identity = getIdentity(kind, field.getType().getIntOrFloatBitWidth());
  for (int64_t i = 0; i < field.getElementCount(); ++i)
    for (unsigned byte = 0; byte < identity.getBitWidth() / 8; ++byte)
      bytes[field.getElementOffset(i) + byte] =
          char(identity.extractBitsAsZExtValue(8, 8 * byte));
  return bytes;
}

/// Combines the numbers of one record, dimension by dimension of the field.
static void combineField(OpBuilder &builder, Location loc, FieldAttr field,
                         AtomicKind kind, Value to, Value from,
                         SmallVectorImpl<Value> &elements) {
  size_t depth = elements.size();
  if (depth < field.getCounts().size()) {
    Value zero = arith::ConstantIndexOp::create(builder, loc, 0);
    Value one = arith::ConstantIndexOp::create(builder, loc, 1);
    Value count =
        arith::ConstantIndexOp::create(builder, loc, field.getCounts()[depth]);
    auto loop = scf::ForOp::create(builder, loc, zero, count, one);
    OpBuilder::InsertionGuard guard(builder);
    builder.setInsertionPoint(loop.getBody()->getTerminator());
    elements.push_back(loop.getInductionVar());
    combineField(builder, loc, field, kind, to, from, elements);
    elements.pop_back();
    return;
  }
  Type type = field.getType();
  Value target = createFieldAddress(builder, loc, to, field, elements);
  Value source = createFieldAddress(builder, loc, from, field, elements);
  Value old = createLoad(builder, loc, type, target, /*tag=*/nullptr);
  Value value = createLoad(builder, loc, type, source, /*tag=*/nullptr);
  createStore(builder, loc, createChange(builder, loc, kind, old, value),
              target, /*tag=*/nullptr);
  APInt identity = getIdentity(kind, type.getIntOrFloatBitWidth());
  createStore(builder, loc,
              arith::ConstantOp::create(builder, loc,
                                        builder.getIntegerAttr(type, identity)),
              source, /*tag=*/nullptr);
}

/// A pikoir_combine.
static LLVM::LLVMFuncOp createCombine(PipelineOp pipeline,
                                      const Reduction &reduction,
                                      RecordOp record) {
  auto module = pipeline->getParentOfType<ModuleOp>();
  OpBuilder builder = OpBuilder::atBlockEnd(module.getBody());
  Location loc = pipeline.getLoc();
  auto pointer = LLVM::LLVMPointerType::get(builder.getContext());
  auto type =
      LLVM::LLVMFunctionType::get(LLVM::LLVMVoidType::get(builder.getContext()),
                                  {pointer, pointer, builder.getI64Type()});
  std::string name =
      (pipeline.getSymName() + ".combine." + reduction.stage.getValue() + "." +
       reduction.state.getValue() + "." + reduction.field.getValue())
          .str();
  auto function = LLVM::LLVMFuncOp::create(builder, loc, name, type,
                                           LLVM::Linkage::Internal);
  for (unsigned argument : {0, 1})
    function.setArgAttr(argument, LLVM::LLVMDialect::getNoAliasAttrName(),
                        builder.getUnitAttr());
  builder.setInsertionPointToEnd(function.addEntryBlock(builder));
  Value zero = arith::ConstantIndexOp::create(builder, loc, 0);
  Value one = arith::ConstantIndexOp::create(builder, loc, 1);
  auto loop = scf::ForOp::create(
      builder, loc, zero, toIndex(builder, loc, function.getArgument(2)), one);
  LLVM::ReturnOp::create(builder, loc, ValueRange());
  builder.setInsertionPoint(loop.getBody()->getTerminator());
  Value bytes = arith::MulIOp::create(
      builder, loc, toI64(builder, loc, loop.getInductionVar()),
      createI64(builder, loc, record.getSize()));
  SmallVector<Value> elements;
  combineField(builder, loc, record.getField(reduction.field), reduction.kind,
               createOffset(builder, loc, function.getArgument(0), bytes),
               createOffset(builder, loc, function.getArgument(1), bytes),
               elements);
  return function;
}

void piko::declareReductions(OpBuilder &builder, Value frame,
                             const PipelineNumbers &numbers,
                             LoweringContext &context) {
  PipelineOp pipeline = numbers.pipeline;
  Location loc = pipeline.getLoc();
  for (const Reduction &reduction : numbers.reductions) {
    Operation *state = SymbolTable::lookupSymbolIn(pipeline, reduction.state);
    RecordOp record = context.record(getStateRecord(state));
    LLVM::LLVMFuncOp combine = createCombine(pipeline, reduction, record);
    FieldAttr field = record.getField(reduction.field);
    auto i32 = [&](int64_t v) { return createI32(builder, loc, v); };
    context.call(
        builder, loc, PIKO_RUNTIME_FUNCTION(pikoir_declare_private),
        {frame, i32(numbers.stages.lookup(reduction.stage)),
         i32(*numbers.findReduction(reduction.stage, reduction.state,
                                    reduction.field)),
         i32(numbers.states.lookup(reduction.state)),
         context.text(builder, loc,
                      getIdentityRecord(record, field, reduction.kind)),
         i32(getRunShift(record)), i32(reduction.often),
         LLVM::AddressOfOp::create(builder, loc, combine)});
  }
}

namespace {

struct PrivateCopyLowering : Lowering<PrivateCopyOp> {
  using Lowering::Lowering;
  LogicalResult
  matchAndRewrite(PrivateCopyOp op, OpAdaptor adaptor,
                  ConversionPatternRewriter &rewriter) const override {
    Location loc = op.getLoc();
    const PipelineNumbers &numbers = context.numbers(op);
    FailureOr<StringAttr> stage = context.kernelStage(op);
    if (failed(stage))
      return failure();
    std::optional<int32_t> copy = numbers.findReduction(
        *stage, op.getStateAttr().getAttr(), op.getField());
    assert(copy && "the pipeline's copies have numbers");
    rewriter.replaceOp(
        op,
        context.call(rewriter, loc, PIKO_RUNTIME_FUNCTION(pikoir_get_private),
                     {adaptor.getWriter(), createI32(rewriter, loc, *copy)}));
    return success();
  }
};

} // namespace

void piko::populateReductionsToLLVMPatterns(const TypeConverter &converter,
                                            RewritePatternSet &patterns,
                                            LoweringContext &context) {
  patterns.add<PrivateCopyLowering>(converter, patterns.getContext(), context);
}
