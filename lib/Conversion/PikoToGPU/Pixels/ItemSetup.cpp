// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Loop fission of a loop over primitives whose pixels the threads of a block
// share. What depends on the primitive alone, its setup, would be computed by
// every thread alike; instead each thread computes that of another primitive:
//
//   for each group of as many primitives as threads
//     setup of mine; what the pixels need of it goes to shared memory
//     barrier
//     for each primitive of the group
//       my pixels, from shared memory
//     barrier
//
// What is left to the pixels, SetupSplit.cpp says. Where shared memory has no
// room for all of the setup, only fields of primitives are shared. Errors keep
// the order of primitives, because each notes which one it is about.

#include "PikoToGPU/Pixels/ItemSetup.h"

#include "PikoToGPU/Pixels/PixelSharing.h"

#include "LoadPlace.h"

#include "pikort/grid.h"

#include "mlir/Interfaces/LoopLikeInterface.h"

using namespace mlir;
using namespace piko;

ItemSetup::ItemSetup(scf::ForOp items, const ThreadTile &tile,
                     GridMemory &memory, Extent extent)
    : items(items), memory(memory), threads(1),
      split(items, extent, tile.place) {
  for (int64_t side : tile.extents)
    threads *= side;
}

//===----------------------------------------------------------------------===//
// Fission
//===----------------------------------------------------------------------===//

/// Values of one type are in one array, so that an address is found once.
void ItemSetup::placeShared() {
  llvm::MapVector<Type, int64_t> sizes;
  for (Value value : split.shared) {
    int64_t &size = sizes[SetupSplit::getStorage(value.getType())];
    places[value].first = size;
    size += threads;
  }
  llvm::DenseMap<Type, Value> arrays;
  for (auto [type, size] : sizes)
    arrays[type] = addSharedMemory(memory.launch, size, type);
  for (auto &[value, place] : places)
    place.memory = arrays.lookup(SetupSplit::getStorage(value.getType()));
}

static Value createPlace(OpBuilder &builder, Location loc, Value number,
                         int64_t first) {
  if (first == 0)
    return number;
  Value constant = arith::ConstantIndexOp::create(builder, loc, first);
  return arith::AddIOp::create(builder, loc, number, constant);
}

void ItemSetup::cloneSetup(Block &from, OpBuilder &to, IRMapping &mapping,
                           PixelHook atPixels) {
  for (Operation &op : from.without_terminator()) {
    if (split.isForPixels(&op)) {
      auto ifOp = dyn_cast<scf::IfOp>(&op);
      if (atPixels)
        atPixels(&op, to, mapping);
      if (!ifOp || split.mustKeep(ifOp))
        continue;
      auto copy = scf::IfOp::create(
          to, op.getLoc(), mapping.lookupOrDefault(ifOp.getCondition()),
          /*withElseRegion=*/ifOp.elseBlock() != nullptr);
      OpBuilder inside = copy.getThenBodyBuilder();
      cloneSetup(*ifOp.thenBlock(), inside, mapping, atPixels);
      if (ifOp.elseBlock()) {
        inside = copy.getElseBodyBuilder();
        cloneSetup(*ifOp.elseBlock(), inside, mapping, atPixels);
      }
      continue;
    }
    Operation *copy = to.clone(op, mapping);
    for (auto [result, value] :
         llvm::zip_equal(op.getResults(), copy->getResults())) {
      auto found = places.find(result);
      if (found == places.end())
        continue;
      Location loc = op.getLoc();
      Type type = SetupSplit::getStorage(result.getType());
      Value stored = value;
      if (type != result.getType())
        stored = arith::ExtUIOp::create(to, loc, type, stored);
      memref::StoreOp::create(to, loc, stored, found->second.memory,
                              createPlace(to, loc,
                                          memory.launch.getThreadIds().x,
                                          found->second.first));
    }
  }
}

void ItemSetup::createSetup(OpBuilder &builder, Value position,
                            PixelHook atPixels) {
  placeShared();
  memory.setPosition(builder, position);
  IRMapping mapping;
  mapping.map(items.getInductionVar(), position);
  cloneSetup(*items.getBody(), builder, mapping, atPixels);
}

void ItemSetup::replaceInPixels() {
  for (auto &[value, place] : places) {
    OpBuilder builder(value.getDefiningOp());
    Location loc = value.getLoc();
    Value at = createPlace(builder, loc, items.getInductionVar(), place.first);
    loads.push_back(memref::LoadOp::create(builder, loc, place.memory, at));
    Value loaded = loads.back();
    if (loaded.getType() != value.getType())
      loaded = arith::TruncIOp::create(builder, loc, value.getType(), loaded);
    Value(value).replaceAllUsesWith(loaded);
  }
  eraseSetup(*items.getBody());
}

void ItemSetup::sinkLoads() {
  for (memref::LoadOp load : loads) {
    Type type = load.getType();
    if (!type.isIndex() && type.getIntOrFloatBitWidth() < 64)
      continue;
    llvm::MapVector<Operation *, SmallVector<OpOperand *>> places;
    for (OpOperand &use : load->getUses())
      places[findLoadPlace(use.getOwner(), items)].push_back(&use);
    for (auto &[place, uses] : places) {
      if (place->getParentOfType<LoopLikeOpInterface>() == items)
        continue;
      OpBuilder builder(place);
      auto again = cast<memref::LoadOp>(builder.clone(*load));
      again.setNontemporal(true); // Not to be kept: GPUToNVVM.cpp.
      for (OpOperand *use : uses)
        use->set(again);
    }
    if (load->use_empty())
      load->erase();
  }
}

/// What has no use any more; the loads have some.
void ItemSetup::eraseSetup(Block &block) {
  for (Operation &op : llvm::make_early_inc_range(llvm::reverse(block))) {
    if (split.isForPixels(&op)) {
      for (Region &region : op.getRegions())
        for (Block &inner : region)
          eraseSetup(inner);
    } else if (!op.hasTrait<OpTrait::IsTerminator>() && op.use_empty()) {
      op.erase();
    }
  }
}

/// A group has few primitives: its counter takes a register, where an index
/// takes two.
static void countInFewBits(scf::ForOp items) {
  OpBuilder builder(items);
  Location loc = items.getLoc();
  Type type = builder.getI32Type();
  auto cast = [&](Value value) {
    return arith::IndexCastOp::create(builder, loc, type, value);
  };
  auto made =
      scf::ForOp::create(builder, loc, cast(items.getLowerBound()),
                         cast(items.getUpperBound()), cast(items.getStep()));
  made->setDiscardableAttrs(items->getDiscardableAttrDictionary());
  builder.setInsertionPointToStart(made.getBody());
  Value number = arith::IndexCastUIOp::create(
      builder, loc, builder.getIndexType(), made.getInductionVar());
  items.getInductionVar().replaceAllUsesWith(number);
  items.getBody()->getTerminator()->erase();
  made.getBody()->getOperations().splice(std::prev(made.getBody()->end()),
                                         items.getBody()->getOperations());
  items.erase();
}

void piko::shareSetup(scf::ForOp items, const ThreadTile &tile,
                      GridMemory &memory) {
  gpu::LaunchOp launch = memory.launch;
  Location loc = items.getLoc();
  OpBuilder builder(items);
  Value begin = items.getLowerBound(), end = items.getUpperBound();
  int64_t room = maxSharedBytes - 8 * PIKOIR_FLUSH_WORDS;
  std::optional<ItemSetup> setup;
  for (Extent extent : {Extent::All, Extent::Fields})
    if (setup.emplace(items, tile, memory, extent); setup->countBytes() <= room)
      break;
  if (setup->isEmpty() || setup->countBytes() > room) {
    builder.setInsertionPointToStart(items.getBody());
    memory.setPosition(builder, items.getInductionVar());
    return;
  }

  Value size = launch.getBlockSizeX();
  auto groups = scf::ForOp::create(builder, loc, begin, end, size);
  builder.setInsertionPointToStart(groups.getBody());
  Value base = groups.getInductionVar();
  Value mine =
      arith::AddIOp::create(builder, loc, base, launch.getThreadIds().x);
  Value any =
      arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::slt, mine, end);
  auto ifAny = scf::IfOp::create(builder, loc, any);
  OpBuilder inside = ifAny.getThenBodyBuilder();
  setup->createSetup(inside, mine);
  gpu::BarrierOp::create(builder, loc);

  Value left = arith::SubIOp::create(builder, loc, end, base);
  Value count = arith::MinSIOp::create(builder, loc, left, size);
  items->moveBefore(groups.getBody()->getTerminator());
  builder.setInsertionPoint(items);
  items.setLowerBound(arith::ConstantIndexOp::create(builder, loc, 0));
  items.setUpperBound(count);
  builder.setInsertionPointToStart(items.getBody());
  Value position =
      arith::AddIOp::create(builder, loc, base, items.getInductionVar());
  items.getInductionVar().replaceAllUsesExcept(position,
                                               position.getDefiningOp());
  memory.setPosition(builder, position);
  setup->replaceInPixels();
  setup->sinkLoads();
  countInFewBits(items);
  builder.setInsertionPoint(groups.getBody()->getTerminator());
  gpu::BarrierOp::create(builder, loc);
}
