// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Piko/Transforms/Storage/PixelAccess.h"

#include "Piko/Dialect/Piko/IR/BinArithmetic.h"
#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/Dialect/Arith/IR/Arith.h"

using namespace mlir;
using namespace piko;

/// The indices, into a field that is an array, of an element of it.
static SmallVector<Value> createIndices(OpBuilder &builder, Location loc,
                                        FieldAttr field, int64_t element) {
  SmallVector<Value> indices(field.getCounts().size());
  for (auto [index, count] :
       llvm::reverse(llvm::zip(indices, field.getCounts()))) {
    index = arith::ConstantIndexOp::create(builder, loc, element % count);
    element /= count;
  }
  return indices;
}

void piko::forEachElement(
    OpBuilder &builder, Location loc, RecordOp record,
    llvm::function_ref<void(FieldAttr, ValueRange)> body) {
  for (auto field : record.getFields().getAsRange<FieldAttr>())
    for (int64_t i = 0, e = field.getElementCount(); i < e; ++i)
      body(field, createIndices(builder, loc, field, i));
}

/// The field of a record's number, and which element of it that is.
static std::pair<FieldAttr, int64_t> findField(RecordOp record,
                                               unsigned number) {
  int64_t rest = number;
  for (auto field : record.getFields().getAsRange<FieldAttr>()) {
    if (rest < field.getElementCount())
      return {field, rest};
    rest -= field.getElementCount();
  }
  llvm_unreachable("a number of the record");
}

PixelAccess::PixelAccess(UpdateOp update)
    : update(update),
      image(lookupInPipeline<ImageOp>(update, update.getImageAttr())),
      loc(update.getLoc()) {}

scf::IfOp piko::createInsideTest(OpBuilder &builder, UpdateOp update,
                                 ValueRange at, TypeRange results) {
  Location loc = update.getLoc();
  StageOp stage = getKernelStage(update);
  bool isKnown = update->hasAttr(marks::inside);
  Value inside = isKnown ? arith::ConstantOp::create(builder, loc,
                                                     builder.getBoolAttr(true))
                         : BinArithmetic(builder, loc, stage)
                               .isInBin(llvm::to_vector(at), update.getBin());
  auto test =
      scf::IfOp::create(builder, loc, results, inside, /*withElseRegion=*/true);
  builder.setInsertionPointToStart(test.elseBlock());
  if (!isKnown) {
    Value bin = findBin(builder, update);
    FailOp::create(builder, loc, stage.getSymName(), update.getImage(), at,
                   /*outside_bin=*/true, bin ? bin : update.getBin(),
                   update.getOfAttr());
  }
  SmallVector<Value> zeros;
  for (Type type : results)
    zeros.push_back(
        arith::ConstantOp::create(builder, loc, builder.getZeroAttr(type)));
  if (!results.empty())
    scf::YieldOp::create(builder, loc, zeros);
  builder.setInsertionPointToStart(test.thenBlock());
  return test;
}

scf::IfOp PixelAccess::createTest(OpBuilder &builder, TypeRange results) {
  builder.setInsertionPoint(update);
  BinArithmetic bins(builder, loc, getKernelStage(update));
  at = llvm::map_to_vector(update.getCoordinates(),
                           [&](Value value) { return bins.toIndex(value); });
  return createInsideTest(builder, update, at, results);
}

Value PixelAccess::load(OpBuilder &builder, ImageOp image, FieldAttr field,
                        ValueRange elements) {
  return LoadOp::create(builder, loc, field.getType(), image.getSymName(), at,
                        field.getName(), elements,
                        image == this->image ? update.getTile() : Value(),
                        /*checked=*/true, /*of=*/nullptr);
}

SmallVector<Value> PixelAccess::load(OpBuilder &builder) {
  SmallVector<Value> numbers;
  forEachElement(builder, loc, lookupRecord(image, image.getRecordAttr()),
                 [&](FieldAttr field, ValueRange elements) {
                   numbers.push_back(load(builder, image, field, elements));
                 });
  return numbers;
}

Value PixelAccess::loadFrom(OpBuilder &builder, ImageOp image) {
  RecordOp record = lookupRecord(image, image.getRecordAttr());
  return load(builder, image, findField(record, 0).first, ValueRange());
}

void PixelAccess::store(OpBuilder &builder, unsigned number, Value value) {
  RecordOp record = lookupRecord(image, image.getRecordAttr());
  auto [field, element] = findField(record, number);
  StoreOp::create(builder, loc, value, image.getSymName(), at, field.getName(),
                  createIndices(builder, loc, field, element), update.getTile(),
                  /*checked=*/true, /*of=*/nullptr);
}

void PixelAccess::change(OpBuilder &builder, ImageOp image, unsigned number,
                         AtomicKind kind, Value value) {
  RecordOp record = lookupRecord(image, image.getRecordAttr());
  auto [field, element] = findField(record, number);
  AtomicOp::create(builder, loc, Type(), kind, image.getSymName(), at,
                   field.getName(), createIndices(builder, loc, field, element),
                   value, /*checked=*/true, update.getOfAttr(),
                   /*copy=*/Value());
}

void PixelAccess::change(OpBuilder &builder, unsigned number, AtomicKind kind,
                         Value value) {
  change(builder, image, number, kind, value);
}

void PixelAccess::changeIn(OpBuilder &builder, ImageOp image, AtomicKind kind,
                           Value value) {
  change(builder, image, 0, kind, value);
}
