// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-share-loops: converts loops over primitives and parallel loops as
// piko-map-threads maps them. Those whose iterations threads share are marked
// `piko.shared`; piko-map-blocks does the rest.

#include "PikoToGPU/Grid/GridMemory.h"
#include "PikoToGPU/Mapping/WorkLegality.h"

#include "Piko/Transforms/Storage/LoopSplitter.h"
#include "Piko/Transforms/Storage/ParallelLoops.h"

#include "Piko/Conversion/Passes.h"
#include "Piko/Dialect/Piko/IR/Marks.h"

namespace piko {
#define GEN_PASS_DEF_SHARELOOPS
#include "Piko/Conversion/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

class LoopSharing {
public:
  explicit LoopSharing(GridMemory &memory)
      : launch(memory.launch), log(memory.log) {}
  LogicalResult run();

private:
  void createVersions();
  void mapItems();
  LogicalResult mapLoop(ParallelLoopOpInterface loop);
  LogicalResult mapPieces(ParallelForOp loop, bool isShared);
  static void addMark(Operation *op, StringRef name) {
    op->setAttr(name, UnitAttr::get(op->getContext()));
  }

  gpu::LaunchOp launch;
  Value log;
};

struct ShareLoopsPass : piko::impl::ShareLoopsBase<ShareLoopsPass> {
  using ShareLoopsBase::ShareLoopsBase;
  void runOnOperation() override;
};

} // namespace

//===----------------------------------------------------------------------===//
// Loops over primitives
//===----------------------------------------------------------------------===//

/// Where there are as many primitives as it takes, threads have some each;
/// otherwise they share the iterations of one after the other.
static void createVersions(scf::ForOp loop) {
  MLIRContext *context = loop.getContext();
  OpBuilder builder(loop);
  Location loc = loop.getLoc();
  int64_t fewest = cast<IntegerAttr>(loop->removeAttr(marks::fewest)).getInt();
  Value count = arith::SubIOp::create(builder, loc, loop.getUpperBound(),
                                      loop.getLowerBound());
  Value many = arith::CmpIOp::create(
      builder, loc, arith::CmpIPredicate::sge, count,
      arith::ConstantIndexOp::create(builder, loc, fewest));
  auto choice = scf::IfOp::create(builder, loc, many, /*withElseRegion=*/true);
  OpBuilder otherwise = choice.getElseBodyBuilder();
  auto mark = [&](Operation *op, ThreadMapping mapping) {
    op->setAttr(marks::threads, ThreadMappingAttr::get(context, mapping));
  };
  mark(otherwise.clone(*loop), ThreadMapping::One);
  loop->moveBefore(choice.thenBlock()->getTerminator());
  mark(loop, ThreadMapping::Shared);
  loop->walk(
      [&](ParallelLoopOpInterface inner) { mark(inner, ThreadMapping::One); });
}

void LoopSharing::createVersions() {
  for (scf::ForOp loop : collect<scf::ForOp>(launch))
    if (loop->hasAttr(marks::fewest))
      ::createVersions(loop);
}

/// Loops over primitives have no marks of their mapping after it.
void LoopSharing::mapItems() {
  for (scf::ForOp loop : collect<scf::ForOp>(launch)) {
    loop->removeAttr(marks::lanes);
    auto mapping =
        dyn_cast_or_null<ThreadMappingAttr>(loop->removeAttr(marks::threads));
    if (!mapping)
      continue;
    bool emits = contains(
        loop, [](Operation *op) { return isa<AppendOp, AppendBinOp>(op); });
    if (mapping.getValue() == ThreadMapping::Shared)
      addMark(loop, marks::shared);
    else if (mapping.getValue() == ThreadMapping::One && emits)
      addMark(loop, marks::ordered);
  }
}

//===----------------------------------------------------------------------===//
// Parallel loops
//===----------------------------------------------------------------------===//

/// Cuts a loop at its barriers; threads share each of its pieces that allows
/// it.
LogicalResult LoopSharing::mapPieces(ParallelForOp loop, bool isShared) {
  if (failed(LoopSplitter(loop, log, isShared).run()))
    return failure();
  launch.walk([&](scf::ForOp piece) {
    bool isApart = bool(piece->removeAttr(marks::disjoint));
    if (piece->removeAttr(marks::lanes) && isShared &&
        (isApart || isIndependent(piece)))
      addMark(piece, marks::shared);
  });
  return success();
}

LogicalResult LoopSharing::mapLoop(ParallelLoopOpInterface loop) {
  auto mark = loop->getAttrOfType<ThreadMappingAttr>(marks::threads);
  if (!mark)
    return loop->emitOpError("expected a mapping to threads, as "
                             "piko-map-threads makes it");
  loop->removeAttr(marks::threads);
  ThreadMapping mapping = mark.getValue();
  if (mapping == ThreadMapping::One) {
    convertLoop(loop);
    launch.walk([](scf::ForOp made) { made->removeAttr(marks::lanes); });
    return success();
  }
  auto pixels = dyn_cast<ParallelPixelsOp>(*loop);
  auto numbered =
      pixels ? numberIterations(pixels) : cast<ParallelForOp>(*loop);
  switch (mapping) {
  case ThreadMapping::Pieces:
  case ThreadMapping::PiecesOfOne:
    return mapPieces(numbered, mapping == ThreadMapping::Pieces);
  case ThreadMapping::Lockstep:
    return success(); // BlockMapping.cpp does the rest
  case ThreadMapping::Shared:
    convertLoop(numbered);
    launch.walk([&](scf::ForOp made) {
      if (made->removeAttr(marks::lanes))
        addMark(made, marks::shared);
    });
    return success();
  default:
    llvm_unreachable("checkMapping refuses others");
  }
}

LogicalResult LoopSharing::run() {
  createVersions();
  mapItems();
  // Those inside others first.
  for (auto loop : collect<ParallelLoopOpInterface>(launch))
    if (failed(mapLoop(loop)))
      return failure();
  return success();
}

void ShareLoopsPass::runOnOperation() {
  FailureOr<SmallVector<GridMemory>> grids = findGrids(getOperation());
  if (failed(grids))
    return signalPassFailure();
  for (GridMemory &memory : *grids)
    if (failed(LoopSharing(memory).run()))
      return signalPassFailure();
}
