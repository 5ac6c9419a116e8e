// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-form-gbuffer, for the work of each kernel over bins that are the whole
// domain: what its primitives overwrite pixels with is computed, as far as it
// can be put off, by a kernel of its own after that one, for bins of a size,
// from what is kept of each pixel in internal images (a G-buffer).
//
// What is left of the first kernel is what piko-reduce-updates or
// piko-reduce-by-atomics lets threads or blocks share, if it is a reduction.
// What is cheaper to compute than to keep stays in it. That is more than
// piko-defer-shading leaves, as what is kept of a screen does not fit the first
// level of a cache.

#include "Deferral/Deferral.h"
#include "Deferral/InternalImage.h"
#include "Support/StateAccess.h"
#include "Support/UnusedName.h"

#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoProgram.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/SCF/IR/SCF.h"

namespace piko {
#define GEN_PASS_DEF_FORMGBUFFER
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct FormGBufferPass : piko::impl::FormGBufferBase<FormGBufferPass> {
  using FormGBufferBase::FormGBufferBase;
  void runOnOperation() override;
  void runOnBins(KernelOp kernel, BinsOp bins);
};

/// Keeps what is deferred in images, and makes the kernel that does it.
class GBuffer {
public:
  GBuffer(LaunchOp launch, const Deferral &what)
      : launch(launch), pipeline(getPipeline(launch)), what(what),
        builder(launch->getContext()) {
    while (!isa<ProgramOp>(around->getParentOp()))
      around = around->getParentOp();
  }
  std::optional<Reason> whyNot();
  void form();

private:
  void createImages();
  void keepAt(size_t site);
  void keep(UpdateOp last, ImageOp image, ArrayRef<Value> numbers);
  StageOp createStage();
  KernelOp createKernel(StageOp stage);
  void addToProgram(StageOp stage, KernelOp kernel);

  LaunchOp launch;            ///< Of the kernel whose work is deferred.
  Operation *around = launch; ///< In which it is launched, maybe repeatedly.
  PipelineOp pipeline;
  const Deferral &what;
  OpBuilder builder;
  ImageOp kept;        ///< What is kept of a pixel; null if that is nothing.
  ImageOp overwritten; ///< Whether there is anything.
};

} // namespace

/// Why the rest cannot be done after all that runs until the last launch.
std::optional<Reason> GBuffer::whyNot() {
  llvm::DenseSet<StringAttr> images = what.getImages(),
                             read = what.getReadState();
  std::optional<Reason> reason;
  around->walk([&](LaunchOp other) {
    if (other == launch)
      return;
    other.getKernelOp().walk([&](Operation *op) {
      auto [state, kinds] = getStateAccess(op);
      if (state &&
          (images.contains(state.getAttr()) ||
           (kinds != StateAccess::reads && read.contains(state.getAttr()))))
        reason = Reason{op->getLoc(),
                        "in strips or on a cycle, this runs between one part "
                        "of the primitives and the next; let the stage wait "
                        "(endStage)"};
    });
  });
  return reason;
}

//===----------------------------------------------------------------------===//
// What is kept
//===----------------------------------------------------------------------===//

void GBuffer::createImages() {
  auto image = cast<ImageOp>(
      SymbolTable::lookupSymbolIn(pipeline, what.getFirst().getImageAttr()));
  SmallVector<Type> types = what.getStoredTypes();
  if (!types.empty())
    kept = createInternalImage(image, "kept", types, /*clear=*/nullptr);
  overwritten = createInternalImage(
      image, "overwritten", {Type(builder.getI32Type())},
      builder.getArrayAttr({Attribute(builder.getI32IntegerAttr(0))}));
}

/// Overwrites the pixel of an image.
void GBuffer::keep(UpdateOp last, ImageOp image, ArrayRef<Value> numbers) {
  builder.setInsertionPoint(last);
  Location loc = last.getLoc();
  auto update = UpdateOp::create(builder, loc, TypeRange(), image.getSymName(),
                                 last.getCoordinates(), last.getBin(),
                                 last.getTile(), last.getOfAttr());
  update->setDiscardableAttrs(last->getDiscardableAttrDictionary());
  Block &body = update.getBody().emplaceBlock();
  for (Value number : numbers)
    body.addArgument(number.getType(), loc);
  builder.setInsertionPointToStart(&body);
  YieldOp::create(builder, loc, numbers, ValueRange());
}

/// Keeps, in place of the updates of a site, what they are computed from.
void GBuffer::keepAt(size_t site) {
  UpdateOp last = what.getLast(site);
  builder.setInsertionPoint(last);
  if (kept)
    keep(last, kept, what.store(builder, site));
  builder.setInsertionPoint(last);
  keep(last, overwritten,
       {Value(arith::ConstantIntOp::create(builder, last.getLoc(), 1, 32))});
}

//===----------------------------------------------------------------------===//
// The kernel after
//===----------------------------------------------------------------------===//

/// The side of a bin of at most 1024 pixels.
static int64_t getSide(size_t rank) {
  constexpr int64_t logPixels = 10;
  return int64_t(1) << (logPixels / rank);
}

/// A stage that nothing comes to, whose process phase runs once for each bin.
StageOp GBuffer::createStage() {
  StageOp of = what.getStage();
  Location loc = what.getWork()->getLoc();
  int64_t lineage = 0;
  for (auto stage : pipeline.getOps<StageOp>()) {
    lineage = std::max(lineage, stage.getLineage().value_or(0) + 1);
    builder.setInsertionPointAfter(stage);
  }
  size_t rank = of.getBins().size();
  constexpr int64_t threads = 64;
  auto stage = StageOp::create(
      builder, loc,
      builder.getStringAttr(
          getUnusedName(pipeline, of.getSymName() + "_pixels")),
      builder.getDenseI64ArrayAttr(SmallVector<int64_t>(rank, getSide(rank))),
      builder.getI64IntegerAttr(threads), of.getInputAttr(),
      builder.getArrayAttr({}));
  if (auto label = of.getLabel())
    stage.setLabel((*label + "_pixels").str());
  stage.setLineage(lineage);
  stage.setOrdered(true);
  stage.setWrites(true);
  stage.setTakesList(true);
  builder.createBlock(&stage.getBody());
  auto schedule = ScheduleOp::create(builder, loc, ScheduleKind::LoadBalance);
  schedule.setEveryBin(true);
  schedule.setResolved(true);
  return stage;
}

KernelOp GBuffer::createKernel(StageOp stage) {
  Location loc = what.getWork()->getLoc();
  builder.setInsertionPointAfter(launch.getKernelOp());
  auto kernel = KernelOp::create(
      builder, loc, getUnusedName(pipeline, "kernel_" + stage.getSymName()));
  builder.createBlock(&kernel.getBody());
  auto name = FlatSymbolRefAttr::get(stage.getSymNameAttr());
  auto bins = BinsOp::create(builder, loc, name);
  Block &body = bins.getBody().emplaceBlock();
  Value bin = body.addArgument(builder.getIndexType(), loc);
  builder.setInsertionPointToStart(&body);
  auto lists = ListsOp::create(builder, loc, name, /*producer=*/nullptr,
                               /*port=*/nullptr, /*lanes=*/nullptr);
  Block &list = lists.getBody().emplaceBlock();
  list.addArgument(ListType::get(builder.getContext(), stage.getInputAttr()),
                   loc);
  builder.setInsertionPointToStart(&list);
  what.createLoop(
      builder, stage, bin,
      [&](ValueRange pixel, std::optional<size_t> number) -> Value {
        ImageOp image = number ? kept : overwritten;
        auto record = image->getParentOfType<ModuleOp>().lookupSymbol<RecordOp>(
            image.getRecord());
        auto field = cast<FieldAttr>(record.getFields()[number.value_or(0)]);
        auto load = LoadOp::create(
            builder, loc, field.getType(), image.getSymName(), pixel,
            field.getName(), /*elements=*/ValueRange(), /*tile=*/Value(),
            /*checked=*/true, /*of=*/StringAttr(), /*assign=*/false);
        load->setAttr(marks::inside, builder.getUnitAttr());
        return load;
      });
  kernel.walk([&](UpdateOp update) { update.getBinMutable().assign(bin); });
  return kernel;
}

/// After all launches of the other kernel, with no pixel overwritten before.
void GBuffer::addToProgram(StageOp stage, KernelOp kernel) {
  Location loc = launch.getLoc();
  builder.setInsertionPoint(around);
  ClearOp::create(builder, loc,
                  builder.getArrayAttr({Attribute(
                      FlatSymbolRefAttr::get(overwritten.getSymNameAttr()))}));
  builder.setInsertionPointAfter(around);
  auto join = JoinOp::create(
      builder, loc, BinsType::get(builder.getContext(), stage.getInputAttr()),
      stage.getSymName(), /*merge=*/false, ValueRange(), ArrayRef<bool>(),
      ArrayRef<int64_t>(), /*keeps=*/IntegerAttr());
  LaunchOp::create(builder, loc, TypeRange(), kernel.getSymName(), join,
                   /*turn=*/nullptr, /*clears=*/nullptr);
}

void GBuffer::form() {
  createImages();
  StageOp stage = createStage();
  KernelOp kernel = createKernel(stage);
  for (size_t site = 0; site < what.getSites().size(); ++site)
    keepAt(site);
  for (const Site &site : what.getSites())
    for (UpdateOp update : site.updates)
      update.erase();
  addToProgram(stage, kernel);
}

//===----------------------------------------------------------------------===//
// The pass
//===----------------------------------------------------------------------===//

void FormGBufferPass::runOnBins(KernelOp kernel, BinsOp bins) {
  auto apply = [&](Deferral &what) -> std::optional<Reason> {
    LaunchOp launch = findLaunch(kernel);
    if (!launch)
      return Reason{kernel.getLoc(), "no program launches it once"};
    GBuffer buffer(launch, what);
    if (std::optional<Reason> reason = buffer.whyNot())
      return reason;
    if (int64_t bytes = what.getBytes(); bytes > budget)
      return Reason{what.getStage().getLoc(),
                    "what is kept of a pixel may have " +
                        std::to_string(budget) + " bytes, but this has " +
                        std::to_string(bytes) +
                        "; give the stage bins of a size"};
    UpdateOp update = what.getFirst();
    update.emitRemark("what is written to '")
        << update.getImage() << "' is computed once for each pixel, by a kernel"
        << " after that of stage '" << getCppName(what.getStage()) << "', from "
        << what.getBytes() << " bytes";
    buffer.form();
    return std::nullopt;
  };
  forEachDeferral(kernel, bins, Deferral::To::Kernel, apply);
}

void FormGBufferPass::runOnOperation() {
  if (budget < 0) {
    getOperation().emitError("expected a budget of at least 0 bytes, but got ")
        << budget.getValue();
    return signalPassFailure();
  }
  for (auto pipeline : getOperation().getOps<PipelineOp>())
    for (auto kernel : llvm::to_vector(pipeline.getOps<KernelOp>()))
      for (auto bins : llvm::to_vector(kernel.getOps<BinsOp>())) {
        auto stage = lookupInPipeline<StageOp>(bins, bins.getStageAttr());
        if (llvm::is_contained(stage.getBins(), 0))
          runOnBins(kernel, bins);
      }
}
