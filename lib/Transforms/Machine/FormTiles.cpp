// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-form-tiles, for each image that a kernel over bins writes:
//   1. find whether it writes the image only in the bin that one thread runs;
//   2. find whether the kernel can begin with the clear value: nothing reads
//   the
//      image before, and the kernel is sure to run;
//   3. make the tile at the start of the bin, let all accesses name it, and
//   write
//      it at the end.

#include "Support/BinOwner.h"
#include "Support/StateAccess.h"

#include "Piko/Dialect/Piko/IR/BinArithmetic.h"
#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoProgram.h"
#include "Piko/Transforms/Passes.h"

#include "llvm/ADT/TypeSwitch.h"

namespace piko {
#define GEN_PASS_DEF_FORMTILES
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct FormTilesPass : piko::impl::FormTilesBase<FormTilesPass> {
  using FormTilesBase::FormTilesBase;
  void runOnOperation() override;
};

/// The accesses to the images of a pipeline.
class ImageAccesses {
public:
  explicit ImageAccesses(PipelineOp pipeline);

  /// Those to an image in a kernel.
  ArrayRef<Operation *> get(KernelOp kernel, StringAttr image) const;
  /// The images of the pipeline that a kernel writes, in the order of their
  /// declaration.
  SmallVector<ImageOp> getWritten(KernelOp kernel) const;

private:
  PipelineOp pipeline;
  llvm::DenseMap<std::pair<Operation *, StringAttr>, SmallVector<Operation *>>
      accesses;
};

/// The tiles of one kernel.
class TileFormer {
public:
  TileFormer(KernelOp kernel, BinsOp bins, const ImageAccesses &accesses)
      : kernel(kernel), bins(bins), accesses(accesses),
        pipeline(getPipeline(kernel)),
        stage(lookupInPipeline<StageOp>(bins, bins.getStageAttr())),
        program(getProgram(pipeline)), launch(findLaunch(kernel)) {}

  /// Why none of the kernel's images can have tiles.
  std::optional<Reason> whyNot();
  std::optional<Reason> whyNot(ImageOp image);
  /// Why another kernel may have written the pixels of an image before.
  std::optional<Reason> whyWritten(ImageOp image);
  bool isDirty(ImageOp image) {
    return whyWritten(image) || whyNotClear(image);
  }
  /// Why the tiles of an image cannot begin with its clear value.
  std::optional<Reason> whyNotClear(ImageOp image);
  int64_t getBytes(ImageOp image);
  void form(ImageOp image, bool clears);
  StageOp getStage() { return stage; }

private:
  bool mayHaveBatches();
  bool isInBin(Operation *access);
  void clear(ImageOp image);

  KernelOp kernel;
  BinsOp bins;
  const ImageAccesses &accesses;
  PipelineOp pipeline;
  StageOp stage;
  ProgramOp program;
  LaunchOp launch; // null if there is not exactly one
};

} // namespace

//===----------------------------------------------------------------------===//
// Who uses an image
//===----------------------------------------------------------------------===//

ImageAccesses::ImageAccesses(PipelineOp pipeline) : pipeline(pipeline) {
  for (auto kernel : pipeline.getOps<KernelOp>())
    kernel.walk([&](StateAccessOpInterface access) {
      FlatSymbolRefAttr state = access.getAccessedState();
      if (lookupInPipeline<ImageOp>(access, state))
        accesses[{kernel, state.getAttr()}].push_back(access);
    });
}

ArrayRef<Operation *> ImageAccesses::get(KernelOp kernel,
                                         StringAttr image) const {
  auto found = accesses.find({kernel, image});
  if (found == accesses.end())
    return {};
  return found->second;
}

static bool writes(Operation *access) {
  return getStateAccess(access).second != StateAccess::reads;
}

SmallVector<ImageOp> ImageAccesses::getWritten(KernelOp kernel) const {
  SmallVector<ImageOp> written;
  for (auto image : PipelineOp(pipeline).getOps<ImageOp>())
    if (!image.getInternal() &&
        llvm::any_of(get(kernel, image.getSymNameAttr()), writes))
      written.push_back(image);
  return written;
}

//===----------------------------------------------------------------------===//
// What is in the way
//===----------------------------------------------------------------------===//

/// Whether the list of a bin may come in several calls.
bool TileFormer::mayHaveBatches() {
  if (ScheduleOp schedule = stage.getSchedule();
      schedule && (schedule.getBatch() || !schedule.getBody().empty()))
    return true;
  // A body that depends on the bin has become a kernel.
  return llvm::any_of(pipeline.getOps<KernelOp>(), [&](KernelOp other) {
    return llvm::any_of(other.getOps<BeginScheduleOp>(),
                        [&](BeginScheduleOp schedule) {
                          return schedule.getStage() == stage.getSymName();
                        });
  });
}

std::optional<Reason> TileFormer::whyNot() {
  if (std::optional<Reason> reason = whyNotOneThread(stage))
    return reason;
  if (stage.getTakesList() && mayHaveBatches())
    return Reason{stage.getLoc(),
                  "its list may be cut into batches; leave out batch"};
  return std::nullopt;
}

/// Whether an access is at a pixel of the bin: by the rule of updates, or
/// because piko-prove-bounds has found so.
bool TileFormer::isInBin(Operation *access) {
  if (auto update = dyn_cast<UpdateOp>(access))
    return update.getBin() == bins.getBin();
  return isa<LoadOp, StoreOp>(access) && access->hasAttr(marks::inside);
}

std::optional<Reason> TileFormer::whyWritten(ImageOp image) {
  StringAttr name = image.getSymNameAttr();
  for (auto other : pipeline.getOps<KernelOp>())
    for (Operation *access : accesses.get(other, name))
      if (other != kernel && writes(access))
        return Reason{
            access->getLoc(),
            "another kernel writes it, too; let one stage do that, or "
            "stages with the same bins that become one kernel"};
  return std::nullopt;
}

std::optional<Reason> TileFormer::whyNot(ImageOp image) {
  StringAttr name = image.getSymNameAttr();
  for (Operation *access : accesses.get(kernel, name)) {
    if (isa<AtomicOp>(access))
      return Reason{access->getLoc(),
                    "this is an atomic; change the pixel by update"};
    if (!isInBin(access))
      return Reason{access->getLoc(),
                    "this pixel is not proved to be in the bin; read it in an "
                    "update, or at a pixel of parallelForPixels"};
  }
  return std::nullopt;
}

std::optional<Reason> TileFormer::whyNotClear(ImageOp image) {
  if (!launch)
    return Reason{kernel.getLoc(), "the program does not launch the kernel at "
                                   "one place"};
  if (launch->getParentOfType<WavesOp>() || launch->getParentOfType<RoundsOp>())
    return Reason{stage.getLoc(), "the stage is on a cycle, and may not run at "
                                  "all; let one after the cycle do that"};
  auto name = FlatSymbolRefAttr::get(image.getSymNameAttr());
  std::optional<Reason> reason;
  bool isCleared = false;
  program.walk<WalkOrder::PreOrder>([&](Operation *op) {
    if (op == launch)
      return WalkResult::interrupt();
    if (auto clear = dyn_cast<ClearOp>(op))
      isCleared |= llvm::is_contained(clear.getStates(), name);
    if (auto keep = dyn_cast<KeepOp>(op); keep && keep.getStateAttr() == name)
      reason.emplace(Reason{keep.getLoc(), "ranks remember what it held"});
    if (auto before = dyn_cast<LaunchOp>(op))
      for (Operation *access :
           accesses.get(before.getKernelOp(), name.getAttr()))
        reason.emplace(Reason{access->getLoc(),
                              "this reads the image before; let it follow, by "
                              "endStage"});
    return WalkResult::advance();
  });
  if (!reason && !isCleared)
    return Reason{image.getLoc(), "the program does not clear it"};
  return reason;
}

int64_t TileFormer::getBytes(ImageOp image) {
  int64_t bytes = lookupRecord(image, image.getRecordAttr()).getSize();
  for (int64_t extent : stage.getBins())
    bytes *= extent;
  return bytes;
}

//===----------------------------------------------------------------------===//
// Forming
//===----------------------------------------------------------------------===//

/// Leaves it to the launch to clear an image.
void TileFormer::clear(ImageOp image) {
  Builder builder(image.getContext());
  auto name = FlatSymbolRefAttr::get(image.getSymNameAttr());
  for (auto clear : llvm::make_early_inc_range(program.getOps<ClearOp>())) {
    SmallVector<Attribute> states(clear.getStates().getValue());
    llvm::erase(states, name);
    if (states.empty())
      clear.erase();
    else
      clear.setStatesAttr(builder.getArrayAttr(states));
  }
  SmallVector<Attribute> clears{name};
  if (ArrayAttr others = launch.getClearsAttr())
    clears.insert(clears.begin(), others.begin(), others.end());
  launch.setClearsAttr(builder.getArrayAttr(clears));
}

void TileFormer::form(ImageOp image, bool clears) {
  Location loc = image.getLoc();
  auto name = FlatSymbolRefAttr::get(image.getSymNameAttr());
  OpBuilder builder(bins.getContext());
  builder.setInsertionPointToStart(bins.getBodyBlock());
  auto type = TileType::get(builder.getContext(), image.getRecordAttr(),
                            stage.getBins());
  Value tile = TileOp::create(builder, loc, type, image.getSymName(), clears,
                              bins.getBin());
  for (Operation *access : accesses.get(kernel, name.getAttr()))
    llvm::TypeSwitch<Operation *>(access).Case<LoadOp, StoreOp, UpdateOp>(
        [&](auto op) { op.getTileMutable().assign(tile); });
  builder.setInsertionPointToEnd(bins.getBodyBlock());
  WriteTileOp::create(builder, loc, tile, image.getSymName(), bins.getBin());
  if (clears)
    clear(image);
}

//===----------------------------------------------------------------------===//
// The pass
//===----------------------------------------------------------------------===//

/// Forms the tiles of a kernel.
static void formTiles(TileFormer former, ArrayRef<ImageOp> images,
                      int64_t budget, bool loads) {
  int64_t bytes = 0;
  std::optional<Reason> general = former.whyNot();
  auto quote = [](StringRef name) { return ("'" + name + "'").str(); };
  std::string who = "stage " + quote(getCppName(former.getStage()));
  // Those that begin with the clear value first: they save more.
  SmallVector<ImageOp> order, others;
  for (ImageOp image : images)
    (former.isDirty(image) ? others : order).push_back(image);
  llvm::append_range(order, others);
  for (ImageOp image : order) {
    std::string name = quote(image.getSymName());
    std::optional<Reason> reason = general, dirty = former.whyWritten(image);
    if (!reason && !loads)
      reason = dirty;
    if (!reason)
      reason = former.whyNot(image);
    if (!dirty)
      dirty = former.whyNotClear(image);
    if (!reason && !loads)
      reason = dirty;
    int64_t more = reason ? 0 : former.getBytes(image);
    if (!reason && bytes + more > budget)
      reason = {image.getLoc(),
                "tiles of a kernel may have " + std::to_string(budget) +
                    " bytes, but these have " + std::to_string(bytes + more) +
                    "; give the stage smaller bins"};
    if (reason) {
      InFlightDiagnostic remark = image.emitRemark()
                                  << who << " has no tiles of " << name;
      remark.attachNote(reason->at) << reason->why;
      continue;
    }
    bytes += more;
    former.form(image, !dirty);
    image.emitRemark() << who << " keeps a bin's pixels of " << name << " in "
                       << more << " bytes"
                       << (dirty ? "" : ", which it clears");
  }
}

void FormTilesPass::runOnOperation() {
  if (budget < 0) {
    getOperation().emitError("expected a budget of at least 0 bytes, but got ")
        << budget.getValue();
    return signalPassFailure();
  }
  ImageAccesses accesses(getOperation());
  for (auto kernel : getOperation().getOps<KernelOp>()) {
    auto bins = kernel.getOps<BinsOp>();
    if (bins.empty() ||
        kernel.walk([](TileOp) { return WalkResult::interrupt(); })
            .wasInterrupted())
      continue;
    formTiles(TileFormer(kernel, *bins.begin(), accesses),
              accesses.getWritten(kernel), budget, loads);
  }
}
