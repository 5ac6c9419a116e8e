// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// For each tile of a kernel:
//   1. an array for each field, with the rows of pixels in a row;
//   2. loops that set it to the clear value, or read it from the image;
//   3. accesses at the pixel's place in the bin;
//   4. loops that write to the image what of the bin is in the domain.

#include "Tiles.h"

#include "Piko/Dialect/Piko/IR/BinArithmetic.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "llvm/ADT/StringMap.h"

using namespace mlir;
using namespace piko;

void piko::forEachElement(
    OpBuilder &builder, Location loc, RecordOp record,
    llvm::function_ref<void(FieldAttr, ValueRange)> body) {
  for (auto field : record.getFields().getAsRange<FieldAttr>())
    for (int64_t i = 0, e = field.getElementCount(); i < e; ++i) {
      SmallVector<Value> indices(field.getCounts().size());
      int64_t rest = i;
      for (auto [index, count] :
           llvm::reverse(llvm::zip(indices, field.getCounts()))) {
        index = arith::ConstantIndexOp::create(builder, loc, rest % count);
        rest /= count;
      }
      body(field, indices);
    }
}

namespace {

class TileLowering {
public:
  explicit TileLowering(TileOp tile);
  void run();

private:
  void createArrays();
  void createClear();
  void createRead();
  void createWrite();
  void replaceAccess(Operation *access);
  /// A loop nest over so many pixels in each dimension; the builder stands in
  /// it.
  void forPixels(ValueRange extents,
                 llvm::function_ref<void(ArrayRef<Value>)> body);
  /// Where a pixel, by its place in the tile, is in a field's array.
  SmallVector<Value> getPlace(ValueRange elements, ArrayRef<Value> pixel);
  SmallVector<Value> getCoordinates(ArrayRef<Value> pixel);

  TileOp tile;
  ImageOp image;
  RecordOp record;
  Location loc;
  OpBuilder builder;
  BinArithmetic bins;
  llvm::StringMap<Value> arrays; // by name of the field
  /// The first cell of the bin, and how many cells are in the domain.
  SmallVector<Value> first, counts;
};

} // namespace

TileLowering::TileLowering(TileOp tile)
    : tile(tile), image(lookupInPipeline<ImageOp>(tile, tile.getImageAttr())),
      record(lookupRecord(image, image.getRecordAttr())), loc(tile.getLoc()),
      builder(tile), bins(builder, loc, getKernelStage(tile)) {}

void TileLowering::createArrays() {
  ArrayRef<int64_t> extents = tile.getTile().getType().getExtents();
  constexpr int64_t lineSize = 64;
  for (auto field : record.getFields().getAsRange<FieldAttr>()) {
    SmallVector<int64_t> shape(field.getCounts());
    llvm::append_range(shape, llvm::reverse(extents));
    arrays[field.getName()] = memref::AllocaOp::create(
        builder, loc, MemRefType::get(shape, field.getType()),
        builder.getI64IntegerAttr(lineSize));
  }
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

SmallVector<Value> TileLowering::getPlace(ValueRange elements,
                                          ArrayRef<Value> pixel) {
  SmallVector<Value> place(elements);
  llvm::append_range(place, llvm::reverse(pixel));
  return place;
}

SmallVector<Value> TileLowering::getCoordinates(ArrayRef<Value> pixel) {
  SmallVector<Value> coordinates;
  for (auto [from, at] : llvm::zip(first, pixel))
    coordinates.push_back(arith::AddIOp::create(builder, loc, from, at));
  return coordinates;
}

void TileLowering::createClear() {
  SmallVector<Value> extents;
  for (int64_t extent : tile.getTile().getType().getExtents())
    extents.push_back(bins.constant(extent));
  SmallVector<TypedAttr> numbers;
  for (Type type : record.getElementTypes())
    numbers.push_back(builder.getZeroAttr(type));
  if (ArrayAttr clear = image.getClearAttr())
    numbers = llvm::map_to_vector(
        clear, [](Attribute number) { return cast<TypedAttr>(number); });
  size_t next = 0;
  forEachElement(builder, loc, record, [&](FieldAttr field, ValueRange es) {
    Value number = arith::ConstantOp::create(builder, loc, numbers[next++]);
    forPixels(extents, [&](ArrayRef<Value> pixel) {
      memref::StoreOp::create(builder, loc, number, arrays.at(field.getName()),
                              getPlace(es, pixel));
    });
  });
}

void TileLowering::createRead() {
  forPixels(counts, [&](ArrayRef<Value> pixel) {
    SmallVector<Value> at = getCoordinates(pixel);
    forEachElement(builder, loc, record, [&](FieldAttr field, ValueRange es) {
      Value number = LoadOp::create(builder, loc, field.getType(),
                                    tile.getImage(), at, field.getName(), es,
                                    /*tile=*/Value(), /*checked=*/true,
                                    /*of=*/nullptr);
      memref::StoreOp::create(builder, loc, number, arrays.at(field.getName()),
                              getPlace(es, pixel));
    });
  });
}

void TileLowering::createWrite() {
  forPixels(counts, [&](ArrayRef<Value> pixel) {
    SmallVector<Value> at = getCoordinates(pixel);
    forEachElement(builder, loc, record, [&](FieldAttr field, ValueRange es) {
      Value number = memref::LoadOp::create(
          builder, loc, arrays.at(field.getName()), getPlace(es, pixel));
      StoreOp::create(builder, loc, number, tile.getImage(), at,
                      field.getName(), es, /*tile=*/Value(), /*checked=*/true,
                      /*of=*/nullptr);
    });
  });
}

void TileLowering::replaceAccess(Operation *access) {
  builder.setInsertionPoint(access);
  auto getPlaceOf = [&](auto op) {
    SmallVector<Value> pixel;
    for (auto [from, index] : llvm::zip(first, op.getIndices()))
      pixel.push_back(
          arith::SubIOp::create(builder, loc, bins.toIndex(index), from));
    return getPlace(op.getElements(), pixel);
  };
  if (auto load = dyn_cast<LoadOp>(access)) {
    Value number = memref::LoadOp::create(
        builder, load.getLoc(), arrays.at(load.getField()), getPlaceOf(load));
    load.replaceAllUsesWith(number);
  } else {
    auto store = cast<StoreOp>(access);
    memref::StoreOp::create(builder, store.getLoc(), store.getValue(),
                            arrays.at(store.getField()), getPlaceOf(store));
  }
  access->erase();
}

void TileLowering::run() {
  createArrays();
  for (int64_t dim = 0, rank = bins.rank(); dim < rank; ++dim) {
    first.push_back(bins.lo(tile.getBin(), dim));
    Value end = bins.hi(tile.getBin(), dim);
    counts.push_back(arith::SubIOp::create(builder, loc, end, first.back()));
  }
  if (tile.getClear()) {
    auto open = *tile->getParentOfType<KernelOp>().getOps<OpenBinsOp>().begin();
    Value clears = ClearsOp::create(builder, loc, open);
    auto choice = scf::IfOp::create(builder, loc, clears, /*withElse=*/true);
    builder.setInsertionPointToStart(choice.thenBlock());
    createClear();
    builder.setInsertionPointToStart(choice.elseBlock());
    createRead();
  } else {
    createRead();
  }
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

void piko::lowerTiles(PipelineOp pipeline) {
  SmallVector<TileOp> tiles;
  pipeline.walk([&](TileOp tile) { tiles.push_back(tile); });
  for (TileOp tile : tiles)
    TileLowering(tile).run();
}
