// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-reduce-updates: lets threads share a bin that is the whole domain, where
// primitives only select what pixels keep, each with images of its own, or
// where the order in which they change them does not show.
//
// Updates of a pixel run in order of lineage, so that one thread runs such a
// bin otherwise, unless each primitive updates one pixel that is known before
// (piko-own-pixels). What threads hold is combined by a function that
// convert-piko-to-llvm makes; the first thread has the state itself
// (runtime/cpu/state/PrivateImages.h).

#include "Deferral/InternalImage.h"
#include "Reductions/CommutingUpdates.h"
#include "Reductions/PixelSelection.h"
#include "Reductions/UnitWork.h"

#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/IR/IRMapping.h"

namespace piko {
#define GEN_PASS_DEF_REDUCEUPDATES
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct ReduceUpdatesPass : piko::impl::ReduceUpdatesBase<ReduceUpdatesPass> {
  void runOnOperation() override;
  void runOnUnits(KernelOp kernel, OpenWriterOp writer);
};

/// Gives units of work images of their own.
class ImagePrivatizer {
public:
  ImagePrivatizer(PipelineOp pipeline, OpenWriterOp writer)
      : pipeline(pipeline), writer(writer), builder(writer->getContext()) {}
  void privatize(const Selection &selection);

private:
  PrivateImagesOp createImages(const Selection &selection, ImageOp unitImage);
  std::pair<UpdateOp, Value> createKept(const Selection::Site &site);
  void noteUnit(const Selection::Site &site, ImageOp unitImage, Value shared);

  PipelineOp pipeline;
  OpenWriterOp writer;
  OpBuilder builder;
  Value unit; ///< As an i32.
};

} // namespace

/// Whether all primitives of a stage are in one bin, which one thread runs for
/// no other reason than that it updates pixels.
static bool runsOneBin(StageOp stage, OpenWriterOp writer) {
  auto units = writer->getParentOfType<scf::ForallOp>();
  auto kind = units->getAttrOfType<UnitLoopAttr>(marks::units);
  return hasOneOrderedBin(stage) && kind && kind.getValue() != UnitLoop::Serial;
}

PrivateImagesOp ImagePrivatizer::createImages(const Selection &selection,
                                              ImageOp unitImage) {
  SmallVector<int64_t> numbers;
  SmallVector<StringRef> comparisons;
  for (const KeyNumber &number : selection.key.numbers) {
    numbers.push_back(number.number);
    comparisons.push_back(number.comparison);
  }
  SmallVector<Attribute> carried, kept;
  for (const Selection::Image &image : selection.images) {
    carried.push_back(FlatSymbolRefAttr::get(image.name));
    kept.push_back(builder.getDenseI64ArrayAttr(image.kept));
  }
  bool often = llvm::any_of(selection.sites, [](const Selection::Site &site) {
    return isRepeatedInWork(site.update);
  });
  builder.setInsertionPointAfter(writer);
  return PrivateImagesOp::create(
      builder, UpdateOp(selection.sites.front().update).getLoc(),
      cast<FlatSymbolRefAttr>(carried.front()),
      builder.getDenseI64ArrayAttr(numbers),
      builder.getStrArrayAttr(comparisons),
      selection.key.last ? builder.getUnitAttr() : UnitAttr(),
      builder.getArrayAttr(ArrayRef(carried).drop_front()),
      builder.getArrayAttr(kept),
      FlatSymbolRefAttr::get(unitImage.getSymNameAttr()), writer,
      often ? builder.getUnitAttr() : UnitAttr());
}

/// The update with, as a result more, whether it keeps new numbers; the value
/// is null if it always does.
std::pair<UpdateOp, Value>
ImagePrivatizer::createKept(const Selection::Site &site) {
  UpdateOp update = site.update;
  if (!site.condition)
    return {update, Value()};
  Location loc = update.getLoc();
  auto known = cast<YieldOp>(update.getBody().front().getTerminator());
  for (auto [result, value] :
       llvm::zip(update.getResults(), known.getResults()))
    if (value == site.condition && site.outcome)
      return {update, result};
  builder.setInsertionPoint(update);
  SmallVector<Type> types(update.getResultTypes());
  types.push_back(builder.getI1Type());
  auto more = UpdateOp::create(builder, loc, types, update.getImage(),
                               update.getCoordinates(), update.getBin(),
                               update.getTile(), update.getOfAttr());
  more->setDiscardableAttrs(update->getDiscardableAttrDictionary());
  more.getBody().takeBody(update.getBody());
  cast<YieldOp>(more.getBody().front().getTerminator())
      .getResultsMutable()
      .append(site.condition);
  update->replaceAllUsesWith(more.getResults().drop_back());
  update.erase();
  builder.setInsertionPointAfter(more);
  Value kept = more.getResults().back();
  if (!site.outcome) {
    Value yes =
        arith::ConstantOp::create(builder, loc, builder.getBoolAttr(true));
    kept = arith::XOrIOp::create(builder, loc, kept, yes);
  }
  return {more, kept};
}

/// Notes, where it keeps them, that the pixel is of this unit now.
void ImagePrivatizer::noteUnit(const Selection::Site &site, ImageOp unitImage,
                               Value shared) {
  Location loc = UpdateOp(site.update).getLoc();
  auto [update, isKept] = createKept(site);
  scf::IfOp after;
  if (isKept)
    for (Operation *user : isKept.getUsers())
      if (auto branch = dyn_cast<scf::IfOp>(user))
        after = branch;
  builder.setInsertionPointAfter(isKept ? isKept.getDefiningOp() : update);
  if (isKept && !after)
    after = scf::IfOp::create(builder, loc, isKept, /*withElse=*/false);
  if (after)
    builder.setInsertionPointToStart(after.thenBlock());
  auto branch = scf::IfOp::create(builder, loc, shared, /*withElse=*/false);
  builder.setInsertionPointToStart(branch.thenBlock());
  auto note =
      UpdateOp::create(builder, loc, TypeRange(), unitImage.getSymName(),
                       update.getCoordinates(), update.getBin(),
                       /*tile=*/Value(), update.getOfAttr());
  note->setDiscardableAttrs(update->getDiscardableAttrDictionary());
  Block &body = note.getBody().emplaceBlock();
  body.addArgument(unit.getType(), loc);
  builder.setInsertionPointToStart(&body);
  YieldOp::create(builder, loc, unit, ValueRange());
}

void ImagePrivatizer::privatize(const Selection &selection) {
  auto key = cast<ImageOp>(
      SymbolTable::lookupSymbolIn(pipeline, selection.images.front().name));
  ImageOp unitImage = createInternalImage(
      key, "unit", {Type(builder.getI32Type())}, /*clear=*/nullptr);
  PrivateImagesOp images = createImages(selection, unitImage);
  if (!unit) {
    builder.setInsertionPointAfter(writer);
    unit = arith::IndexCastOp::create(builder, writer.getLoc(),
                                      builder.getI32Type(), writer.getUnit());
  }
  for (const Selection::Site &site : selection.sites)
    noteUnit(site, unitImage, images.getShared());
}

void ReduceUpdatesPass::runOnUnits(KernelOp kernel, OpenWriterOp writer) {
  StageOp stage = getKernelStage(writer);
  if (!stage || !runsOneBin(stage, writer))
    return;
  SmallVector<CommutingUpdate> commuting = findCommutingUpdates(kernel);
  llvm::SetVector<StringAttr> images = getImages(commuting);
  SelectionFinder finder(kernel, images);
  if (!finder.find()) {
    InFlightDiagnostic remark = mlir::emitRemark(stage.getLoc(), "stage '")
                                << getCppName(stage)
                                << "' runs its only bin on one thread";
    remark.attachNote(finder.reason->at) << finder.reason->why;
    return;
  }
  // Threads take ascending units then: a core has none of its own.
  auto units = writer->getParentOfType<scf::ForallOp>();
  units->setAttr(marks::units,
                 UnitLoopAttr::get(&getContext(), UnitLoop::Shared));
  ImagePrivatizer privatizer(getPipeline(kernel), writer);
  for (const Selection &selection : finder.selections) {
    UpdateOp first = selection.sites.front().update;
    InFlightDiagnostic remark = first.emitRemark("stage '")
                                << getCppName(stage)
                                << "' selects pixels of private images, which "
                                   "are combined when its kernel ends:";
    appendImages(remark, selection);
    privatizer.privatize(selection);
  }
  makeAtomic(stage, commuting);
  stage.setSplit(true);
  if (finder.selections.empty())
    stage.setOrdered(false);
}

void ReduceUpdatesPass::runOnOperation() {
  for (auto pipeline : getOperation().getOps<PipelineOp>())
    for (auto kernel : pipeline.getOps<KernelOp>())
      if (OpenWriterOp writer = findUnitWriter(kernel))
        runOnUnits(kernel, writer);
}
