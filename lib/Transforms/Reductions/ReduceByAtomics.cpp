// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-reduce-by-atomics: lets blocks share a bin that is the whole domain, or
// threads what has come to a bin along a local edge. Updates of a pixel run in
// order of lineage, so that one block, or one thread, would run it. A kernel,
// or work in it, whose primitives select what pixels keep becomes several,
// which take the same primitives:
//   1. for each word of the key, one that finds out by an atomic minimum what
//      comes first in each pixel; it does nothing else;
//   2. the kernel itself, in which a primitive changes the pixels that are its.
//      Nobody else does, so that no order shows.
// So what is carried is computed once for each pixel (a visibility buffer).

#include "Reductions/CommutingUpdates.h"
#include "Reductions/SelectionWords.h"
#include "Support/StateAccess.h"
#include "Support/UnusedName.h"

#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoCount.h"
#include "Piko/Dialect/Piko/IR/PikoProgram.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/IRMapping.h"

namespace piko {
#define GEN_PASS_DEF_REDUCEBYATOMICS
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct ReduceByAtomicsPass
    : piko::impl::ReduceByAtomicsBase<ReduceByAtomicsPass> {
  void runOnOperation() override;
  void runOnWork(KernelOp kernel, ItemsOp items, StageOp stage);
};

/// Makes several kernels of one, or, after a local edge, several pieces of
/// work.
class WorkSplitter {
public:
  WorkSplitter(KernelOp kernel, ItemsOp items, ArrayRef<Selection> selections)
      : kernel(kernel), items(items), selections(selections) {
    for (const Selection &selection : selections)
      words.emplace_back(selection);
  }
  int64_t countPasses() const;
  void split();

private:
  void createPass(int64_t pass);
  void nameKernel(KernelOp copy);
  void clearWords();

  KernelOp kernel;
  ItemsOp items;
  ArrayRef<Selection> selections;
  SmallVector<SelectionWords> words;
};

} // namespace

/// More would take longer than what they save.
static constexpr int64_t mostPasses = 2;

//===----------------------------------------------------------------------===//
// Kernels
//===----------------------------------------------------------------------===//

int64_t WorkSplitter::countPasses() const {
  int64_t passes = 0;
  for (const SelectionWords &of : words)
    passes = std::max(passes, of.size());
  return passes;
}

/// Removes what work does besides computing, failing and `kept`.
static void removeEffects(Operation *work,
                          const llvm::DenseSet<Operation *> &kept) {
  SmallVector<Operation *> effects;
  work->walk([&](Operation *op) {
    if (isa<EmissionOpInterface, PlaceOp, StoreOp, AtomicOp, UpdateOp>(op) &&
        !kept.contains(op))
      effects.push_back(op);
  });
  for (Operation *op : llvm::reverse(effects))
    op->erase();
}

/// As one that precedes the other.
void WorkSplitter::nameKernel(KernelOp copy) {
  copy.setSymName(
      getUnusedName(getPipeline(kernel), kernel.getSymName() + "_first"));
  copy.setPrecedesAttr(FlatSymbolRefAttr::get(kernel.getSymNameAttr()));
}

void WorkSplitter::createPass(int64_t pass) {
  Operation *whole = items.getProducer() ? items.getOperation() : kernel;
  OpBuilder builder(whole);
  IRMapping copies;
  Operation *copy = builder.clone(*whole, copies);
  if (auto other = dyn_cast<KernelOp>(copy))
    nameKernel(other);
  else
    copy->setDiscardableAttr(marks::again, builder.getUnitAttr());
  SmallVector<std::pair<const SelectionWords *, Selection::Site>> sites;
  llvm::DenseSet<Operation *> updates;
  for (auto [selection, of] : llvm::zip(selections, words))
    for (Selection::Site site : selection.sites) {
      site.update = cast<UpdateOp>(copies.lookup(site.update.getOperation()));
      if (site.condition)
        site.condition = copies.lookupOrDefault(site.condition);
      sites.push_back({&of, site});
      updates.insert(site.update);
    }
  removeEffects(copy, updates);
  // A selection by fewer words finds its last one once more.
  for (auto &[of, site] : sites)
    of->reduce(site, std::min(pass, of->size() - 1));
}

/// A launch, or the strips that it is in.
static Operation *findAround(LaunchOp launch) {
  auto strips = dyn_cast<StripsOp>(launch->getParentOp());
  return strips ? strips.getOperation() : launch.getOperation();
}

/// Before the kernel's launch, as positions are those in a strip; but once
/// where what strips before have left comes after all that is still selected.
void WorkSplitter::clearWords() {
  LaunchOp launch = findLaunch(kernel);
  for (const SelectionWords &of : words) {
    SmallVector<Attribute> images;
    for (ImageOp image : of.getImages())
      images.push_back(FlatSymbolRefAttr::get(image.getSymNameAttr()));
    OpBuilder builder(of.mayStay() ? findAround(launch)
                                   : launch.getOperation());
    ClearOp::create(builder, launch.getLoc(), builder.getArrayAttr(images));
  }
}

void WorkSplitter::split() {
  for (SelectionWords &of : words)
    of.createImages(getPipeline(kernel));
  // Threads have primitives: what one does is in order.
  items.setLanes(LaneMapping::Items);
  for (int64_t pass = 0; pass < countPasses(); ++pass)
    createPass(pass);
  for (auto [selection, of] : llvm::zip(selections, words)) {
    for (UpdateOp update : selection.carried)
      SelectionWords::resolveCarried(update);
    for (const Selection::Site &site : selection.sites)
      of.resolve(site);
  }
  clearWords();
}

//===----------------------------------------------------------------------===//
// Which kernels
//===----------------------------------------------------------------------===//

/// Work of a kernel on the primitives of bins that updates pixels; null if
/// there is none.
static ItemsOp findItems(KernelOp kernel) {
  ItemsOp found;
  kernel.walk([&](UpdateOp update) {
    auto items = update->getParentOfType<ItemsOp>();
    if (!items || !isa<BinsOp>(items->getParentOp()))
      return WalkResult::advance();
    found = items;
    return WalkResult::interrupt();
  });
  return found;
}

/// Whether it is all that changes pixels in order.
static bool isOnly(ItemsOp items) {
  // What follows in the bin would run in the kernel that precedes this one.
  auto bins = cast<BinsOp>(items->getParentOp());
  if (!items.getProducer() &&
      !llvm::hasSingleElement(bins.getOps<WorkOpInterface>()))
    return false;
  return !bins.walk([&](UpdateOp update) {
                return items->isProperAncestor(update)
                           ? WalkResult::advance()
                           : WalkResult::interrupt();
              })
              .wasInterrupted();
}

/// Why work of a kernel cannot be done twice.
static std::optional<Reason> whyNotTwice(KernelOp kernel, ItemsOp items) {
  llvm::DenseSet<StringAttr> written = getWrittenState(kernel);
  std::optional<Reason> reason;
  items.walk([&](Operation *op) {
    auto [state, kinds] = getStateAccess(op);
    const char *why = nullptr;
    if (isa<CountOp, CountElementOp>(op))
      why = "what is counted is done in order";
    else if (isa<BarrierOpInterface>(op))
      why = "iterations wait for each other here";
    else if (auto atomic = dyn_cast<AtomicOp>(op); atomic && atomic.getOld())
      why = "the number that this gives depends on the order";
    else if (!llvm::all_of(op->getUsers(), [&](Operation *user) {
               return !isa<EmissionOpInterface>(op) || isa<PlaceOp>(user);
             }))
      why = "where this goes depends on elements that are chosen when it runs";
    else if (state && kinds == StateAccess::reads &&
             written.contains(state.getAttr()))
      why = "this reads what the stage writes; read what another stage has "
            "written";
    if (!why)
      return WalkResult::advance();
    reason = Reason{op->getLoc(), why};
    return WalkResult::interrupt();
  });
  // Strips follow each other in order of lineage; waves do not.
  LaunchOp launch = findLaunch(kernel);
  if (!reason && !(launch && isa<ProgramOp>(findAround(launch)->getParentOp())))
    reason =
        Reason{kernel.getLoc(), "it is on a cycle, where primitives of one "
                                "wave may come before those of another"};
  return reason;
}

static void refuse(StageOp stage, bool isLocal, const Reason &reason) {
  InFlightDiagnostic remark =
      mlir::emitRemark(stage.getLoc(), "stage '")
      << getCppName(stage) << "' runs "
      << (isLocal ? "a bin on one thread" : "its only bin in one block");
  remark.attachNote(reason.at) << reason.why;
}

void ReduceByAtomicsPass::runOnWork(KernelOp kernel, ItemsOp items,
                                    StageOp stage) {
  if (!isOnly(items)) {
    refuse(stage, bool(items.getProducer()),
           {items.getLoc(), "its kernel does other work in the bin, too; give "
                            "stages that follow it bins of another size"});
    return;
  }
  SmallVector<CommutingUpdate> commuting = findCommutingUpdates(kernel);
  llvm::SetVector<StringAttr> images = getImages(commuting);
  SelectionFinder finder(kernel, images);
  std::optional<Reason> reason;
  if (!finder.find())
    reason = finder.reason;
  else if (!finder.selections.empty())
    reason = whyNotTwice(kernel, items);
  WorkSplitter splitter(kernel, items, finder.selections);
  if (!reason && splitter.countPasses() > mostPasses)
    reason =
        Reason{finder.selections.front().sites.front().update->getLoc(),
               "its key and the position of a primitive take more than two "
               "words of 64 bits; let it have fewer or narrower numbers"};
  if (reason) {
    refuse(stage, bool(items.getProducer()), *reason);
    return;
  }
  makeAtomic(stage, commuting);
  for (const Selection &selection : finder.selections) {
    InFlightDiagnostic remark =
        mlir::emitRemark(selection.sites.front().update->getLoc(), "stage '")
        << getCppName(stage)
        << "' finds out by atomic operations which primitive a pixel is of, "
           "and then changes:";
    appendImages(remark, selection);
  }
  if (!finder.selections.empty())
    splitter.split();
  if (items.getProducer())
    return;
  stage.setOrdered(false);
  stage.setSplit(true);
}

void ReduceByAtomicsPass::runOnOperation() {
  for (auto pipeline : getOperation().getOps<PipelineOp>())
    for (auto kernel : llvm::to_vector(pipeline.getOps<KernelOp>())) {
      ItemsOp items = findItems(kernel);
      if (!items)
        continue;
      auto stage = lookupInPipeline<StageOp>(items, items.getStageAttr());
      ScheduleOp schedule = stage.getSchedule();
      bool isSerial = schedule && schedule.getKind() == ScheduleKind::Serialize;
      // In a bin of a size its pixels are shared: see PixelSharing.cpp.
      if (items.getProducer() || (hasOneOrderedBin(stage) && !isSerial))
        runOnWork(kernel, items, stage);
    }
}
