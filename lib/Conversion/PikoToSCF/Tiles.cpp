// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// A tile is, for each type of numbers, a private array: pixel after pixel, row
// after row. A pixel's numbers lie together, as LLVM forms vectors of what is
// computed for them where they are stored in a row. Or the tile stays where it
// is in the image, whose rows are cleared when the bin begins: they are in the
// cache from then on. Of one that is not cleared the runtime may make a copy.

#include "PikoToSCF/Tiles.h"

#include "Piko/Analysis/TargetModel.h"
#include "Piko/Transforms/Storage/PixelAccess.h"

#include "Piko/Dialect/Piko/IR/BinArithmetic.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "llvm/ADT/MapVector.h"
#include "llvm/ADT/StringMap.h"
#include "llvm/ADT/TypeSwitch.h"

using namespace mlir;
using namespace piko;

namespace {

class TileLowering {
public:
  explicit TileLowering(TileOp tile);
  void makePrivate();
  void leaveInImage();

private:
  void offerCopy();
  ArrayRef<int64_t> getExtents() {
    return tile.getTile().getType().getExtents();
  }
  void createArrays();
  void findBin();
  /// A region for what happens if tiles begin with their clear value.
  scf::IfOp createChoice(bool withElse);
  /// Calls `body` with each number of the record and its clear value.
  void
  forEachClear(llvm::function_ref<void(FieldAttr, ValueRange, Value)> body);
  void createClear();
  void clearImage();
  void createRead();
  void createWrite();
  void replaceAccess(Operation *access);
  /// A loop nest over so many pixels in each dimension; the builder stands in
  /// it.
  void forPixels(ValueRange extents,
                 llvm::function_ref<void(ArrayRef<Value>)> body);
  /// The number of a pixel, by its place in the tile, among all of them.
  Value getNumber(ArrayRef<Value> pixel);
  /// Where an element of a field of a pixel is in its array.
  Value getPlace(FieldAttr field, ValueRange elements, Value number);
  Value load(FieldAttr field, ValueRange elements, Value number);
  void store(Value value, FieldAttr field, ValueRange elements, Value number);
  void storeInImage(Value value, ValueRange at, FieldAttr field,
                    ValueRange elements) {
    StoreOp::create(builder, loc, value, tile.getImage(), at, field.getName(),
                    elements, /*tile=*/Value(), /*checked=*/true,
                    /*of=*/nullptr);
  }
  Value times(Value value, int64_t factor) {
    return arith::MulIOp::create(builder, loc, value, bins.constant(factor));
  }
  Value add(Value a, Value b) {
    return arith::AddIOp::create(builder, loc, a, b);
  }
  SmallVector<Value> getCoordinates(ArrayRef<Value> pixel);

  TileOp tile;
  ImageOp image;
  RecordOp record;
  Location loc;
  OpBuilder builder;
  BinArithmetic bins;
  struct Array {
    Value memory;
    int64_t count = 0; // numbers of a pixel
  };
  llvm::MapVector<Type, Array> arrays;
  llvm::StringMap<int64_t> places; // of fields among the numbers of their type
  /// The first cell of the bin, and how many cells are in the domain.
  SmallVector<Value> first, counts;
};

} // namespace

TileLowering::TileLowering(TileOp tile)
    : tile(tile), image(lookupInPipeline<ImageOp>(tile, tile.getImageAttr())),
      record(lookupRecord(image, image.getRecordAttr())), loc(tile.getLoc()),
      builder(tile), bins(builder, loc, getKernelStage(tile)) {}

void TileLowering::createArrays() {
  for (auto field : record.getFields().getAsRange<FieldAttr>()) {
    Array &array = arrays[field.getType()];
    places[field.getName()] = array.count;
    array.count += field.getElementCount();
  }
  int64_t pixels = ShapedType::getNumElements(getExtents());
  for (auto &[type, array] : arrays)
    array.memory = memref::AllocaOp::create(
        builder, loc, MemRefType::get({pixels * array.count}, type),
        builder.getI64IntegerAttr(lineSize));
}

void TileLowering::forPixels(ValueRange extents,
                             llvm::function_ref<void(ArrayRef<Value>)> body) {
  OpBuilder::InsertionGuard guard(builder);
  Value zero = bins.constant(0), one = bins.constant(1);
  SmallVector<Value> pixel(extents.size());
  for (size_t dim = extents.size(); dim-- > 0;) {
    auto loop = scf::ForOp::create(builder, loc, zero, extents[dim], one);
    pixel[dim] = loop.getInductionVar();
    builder.setInsertionPointToStart(loop.getBody());
  }
  body(pixel);
}

Value TileLowering::getNumber(ArrayRef<Value> pixel) {
  Value number = pixel.back();
  for (auto [at, extent] :
       llvm::reverse(llvm::zip(pixel.drop_back(), getExtents().drop_back())))
    number = add(times(number, extent), at);
  return number;
}

Value TileLowering::getPlace(FieldAttr field, ValueRange elements,
                             Value number) {
  Value element = bins.constant(0);
  for (auto [at, count] : llvm::zip(elements, field.getCounts()))
    element = add(times(element, count), at);
  Value first = add(times(number, arrays.lookup(field.getType()).count),
                    bins.constant(places.at(field.getName())));
  return add(first, element);
}

SmallVector<Value> TileLowering::getCoordinates(ArrayRef<Value> pixel) {
  SmallVector<Value> coordinates;
  for (auto [from, at] : llvm::zip(first, pixel))
    coordinates.push_back(arith::AddIOp::create(builder, loc, from, at));
  return coordinates;
}

void TileLowering::forEachClear(
    llvm::function_ref<void(FieldAttr, ValueRange, Value)> body) {
  SmallVector<TypedAttr> numbers;
  for (Type type : record.getElementTypes())
    numbers.push_back(builder.getZeroAttr(type));
  if (ArrayAttr clear = image.getClearAttr())
    numbers = llvm::map_to_vector(
        clear, [](Attribute number) { return cast<TypedAttr>(number); });
  size_t next = 0;
  forEachElement(builder, loc, record, [&](FieldAttr field, ValueRange es) {
    body(field, es, arith::ConstantOp::create(builder, loc, numbers[next++]));
  });
}

void TileLowering::createClear() {
  // One loop, or LLVM would unroll the inner one and scatter over rows.
  auto loop = scf::ForOp::create(
      builder, loc, bins.constant(0),
      bins.constant(ShapedType::getNumElements(getExtents())),
      bins.constant(1));
  OpBuilder::InsertionGuard guard(builder);
  builder.setInsertionPointToStart(loop.getBody());
  forEachClear([&](FieldAttr field, ValueRange es, Value value) {
    store(value, field, es, loop.getInductionVar());
  });
}

void TileLowering::clearImage() {
  forPixels(counts, [&](ArrayRef<Value> pixel) {
    SmallVector<Value> at = getCoordinates(pixel);
    forEachClear([&](FieldAttr field, ValueRange es, Value value) {
      storeInImage(value, at, field, es);
    });
  });
}

void TileLowering::createRead() {
  forPixels(counts, [&](ArrayRef<Value> pixel) {
    SmallVector<Value> at = getCoordinates(pixel);
    Value number = getNumber(pixel);
    forEachElement(builder, loc, record, [&](FieldAttr field, ValueRange es) {
      Value value = LoadOp::create(builder, loc, field.getType(),
                                   tile.getImage(), at, field.getName(), es,
                                   /*tile=*/Value(), /*checked=*/true,
                                   /*of=*/nullptr);
      store(value, field, es, number);
    });
  });
}

void TileLowering::createWrite() {
  forPixels(counts, [&](ArrayRef<Value> pixel) {
    SmallVector<Value> at = getCoordinates(pixel);
    Value number = getNumber(pixel);
    forEachElement(builder, loc, record, [&](FieldAttr field, ValueRange es) {
      storeInImage(load(field, es, number), at, field, es);
    });
  });
}

Value TileLowering::load(FieldAttr field, ValueRange elements, Value number) {
  return memref::LoadOp::create(builder, loc,
                                arrays.lookup(field.getType()).memory,
                                getPlace(field, elements, number));
}

void TileLowering::store(Value value, FieldAttr field, ValueRange elements,
                         Value number) {
  memref::StoreOp::create(builder, loc, value,
                          arrays.lookup(field.getType()).memory,
                          getPlace(field, elements, number));
}

void TileLowering::replaceAccess(Operation *access) {
  builder.setInsertionPoint(access);
  auto getNumberOf = [&](auto op) {
    SmallVector<Value> pixel;
    for (auto [from, index] : llvm::zip(first, op.getIndices()))
      pixel.push_back(
          arith::SubIOp::create(builder, loc, bins.toIndex(index), from));
    return getNumber(pixel);
  };
  if (auto read = dyn_cast<LoadOp>(access)) {
    Value number = getNumberOf(read);
    read.replaceAllUsesWith(
        load(record.getField(read.getField()), read.getElements(), number));
  } else {
    auto write = cast<StoreOp>(access);
    Value number = getNumberOf(write);
    store(write.getValue(), record.getField(write.getField()),
          write.getElements(), number);
  }
  access->erase();
}

void TileLowering::findBin() {
  for (int64_t dim = 0, rank = bins.rank(); dim < rank; ++dim) {
    first.push_back(bins.lo(tile.getBin(), dim));
    Value end = bins.hi(tile.getBin(), dim);
    counts.push_back(arith::SubIOp::create(builder, loc, end, first.back()));
  }
}

scf::IfOp TileLowering::createChoice(bool withElse) {
  auto open = *tile->getParentOfType<KernelOp>().getOps<OpenBinsOp>().begin();
  Value clears = ClearsOp::create(builder, loc, open);
  auto choice = scf::IfOp::create(builder, loc, clears, withElse);
  builder.setInsertionPointToStart(choice.thenBlock());
  return choice;
}

void TileLowering::makePrivate() {
  createArrays();
  findBin();
  if (tile.getClear()) {
    scf::IfOp choice = createChoice(/*withElse=*/true);
    createClear();
    builder.setInsertionPointToStart(choice.elseBlock());
  }
  createRead();
  for (Operation *user : llvm::make_early_inc_range(tile->getUsers())) {
    if (!isa<WriteTileOp>(user)) {
      replaceAccess(user);
      continue;
    }
    builder.setInsertionPoint(user);
    createWrite();
    user->erase();
  }
  tile.erase();
}

/// Few rows are in the cache together, however far apart they are.
static bool mayCompete(ArrayRef<int64_t> extents) {
  constexpr int64_t few = 8;
  return extents.size() == 2 && extents[1] > few;
}

/// The primitives of the bin at whose start an operation stands.
static BucketRangeOp findRange(Operation *op) {
  for (; op && !isa<scf::ForallOp>(op); op = op->getParentOp())
    for (auto range : op->getBlock()->getOps<BucketRangeOp>())
      if (range->isBeforeInBlock(op))
        return range;
  return {};
}

/// Lets the runtime copy the pixels of a bin that has many primitives. What is
/// cleared first is in the cache from then on: it was measured to gain nothing.
void TileLowering::offerCopy() {
  auto units = tile->getParentOfType<scf::ForallOp>();
  BucketRangeOp range = findRange(tile);
  if (!units || !mayCompete(getExtents()) || !range)
    return;
  auto writers = units.getBody()->getOps<OpenWriterOp>();
  if (writers.empty())
    return;
  Value writer = *writers.begin();
  OpBuilder::InsertionGuard guard(builder);
  Value count =
      arith::SubIOp::create(builder, loc, range.getEnd(), range.getBegin());
  Value copied =
      OpenTileOp::create(builder, loc, builder.getI1Type(), tile.getImageAttr(),
                         tile.getBin(), writer, count);
  for (Operation *user : tile->getUsers())
    if (isa<WriteTileOp>(user)) {
      builder.setInsertionPoint(user);
      CloseTileOp::create(builder, loc, tile.getImageAttr(), writer, copied);
    }
}

void TileLowering::leaveInImage() {
  if (tile.getClear()) {
    findBin();
    createChoice(/*withElse=*/false);
    clearImage();
  } else {
    offerCopy();
  }
  for (Operation *user : llvm::make_early_inc_range(tile->getUsers()))
    llvm::TypeSwitch<Operation *>(user)
        .Case<LoadOp, StoreOp>(
            [](auto access) { access.getTileMutable().clear(); })
        .Default([](Operation *write) { write->erase(); });
  tile.erase();
}

LogicalResult piko::lowerTiles(PipelineOp pipeline, bool arePrivate) {
  SmallVector<TileOp> tiles;
  pipeline.walk([&](TileOp tile) { tiles.push_back(tile); });
  for (TileOp tile : tiles) {
    auto kernel = tile->getParentOfType<KernelOp>();
    if (kernel.getOps<OpenBinsOp>().empty() || !getKernelStage(tile))
      return tile.emitOpError(
          "expected loops over units, as piko-form-units makes them");
  }
  for (TileOp tile : tiles)
    if (TileLowering lowering(tile); arePrivate)
      lowering.makePrivate();
    else
      lowering.leaveInImage();
  return success();
}
