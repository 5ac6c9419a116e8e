// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// An update selects if it gives numbers of the pixel other values on one
// condition, which compares new numbers with those that they replace
// (KeyReader). What it overwrites without any condition keeps the last.
//
// Other images may be overwritten, at the same pixel, where the update says
// that it has changed something. What is computed there must not fail, nor
// leave anything else, as it may be done for what another thread's primitives
// replace.

#include "Reductions/PixelSelection.h"

#include "Deferral/SplitUpdate.h"
#include "Reductions/KeyReader.h"
#include "Support/StateAccess.h"

#include "Piko/Dialect/Piko/IR/PikoCPU.h"
#include "Piko/Dialect/Piko/IR/PikoCheck.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/Transforms/RegionUtils.h"

using namespace mlir;
using namespace piko;

/// What an array of an update holds depends on all that is stored in it, and on
/// what decides whether it is, where that does not decide about the load, too.
static void addStored(memref::LoadOp load, UpdateOp update,
                      llvm::SetVector<Value> &reached) {
  for (Operation *user : load.getMemRef().getUsers()) {
    if (!isa<memref::StoreOp>(user))
      continue;
    for (Operation *at = user; !at->isAncestor(load) && at != update;
         at = at->getParentOp()) {
      getUsedValuesDefinedAbove(at->getRegions(), reached);
      reached.insert(at->operand_begin(), at->operand_end());
    }
  }
}

bool piko::dependsOnPixel(Value value, UpdateOp update) {
  llvm::SetVector<Value> reached;
  reached.insert(value);
  for (size_t i = 0; i < reached.size(); ++i) {
    Value used = reached[i];
    if (!update.getBody().isAncestor(used.getParentRegion()))
      continue;
    Operation *op = used.getDefiningOp();
    if (!op) // of the update, or of a loop in it
      return true;
    if (auto load = dyn_cast<memref::LoadOp>(op))
      addStored(load, update, reached);
    getUsedValuesDefinedAbove(op->getRegions(), reached);
    reached.insert(op->operand_begin(), op->operand_end());
  }
  return false;
}

//===----------------------------------------------------------------------===//
// Updates
//===----------------------------------------------------------------------===//

/// Whether a choice is on a site's condition, if that is one.
static bool isSame(const Choice &choice, const Selection::Site &site) {
  if (choice.condition == site.condition)
    return choice.outcome == site.outcome;
  auto getCompare = [](Value value) {
    return value ? value.getDefiningOp<arith::CmpIOp>() : arith::CmpIOp();
  };
  arith::CmpIOp a = getCompare(choice.condition),
                b = getCompare(site.condition);
  return a && b && choice.outcome != site.outcome && a.getLhs() == b.getLhs() &&
         a.getRhs() == b.getRhs() &&
         a.getPredicate() == arith::invertPredicate(b.getPredicate());
}

/// Finds which numbers a site keeps, on which condition; a reason if it is not
/// one for all, or they depend on the pixel.
static const char *readSite(Selection::Site &site, Selection::Image &image,
                            SmallVectorImpl<Value> &values) {
  UpdateOp update = site.update;
  Block &body = update.getBody().front();
  auto yield = cast<YieldOp>(body.getTerminator());
  image.name = update.getImageAttr().getAttr();
  for (auto [number, old] : llvm::enumerate(body.getArguments())) {
    Value value = yield.getPixel()[number];
    if (value == old)
      continue;
    Choice choice{Value(), true, value};
    if (std::optional<Choice> found = getChoice(value, old))
      choice = *found;
    if (dependsOnPixel(choice.value, update))
      return "the pixel becomes something that depends on what it was";
    if (image.kept.empty()) {
      site.condition = choice.condition;
      site.outcome = choice.outcome;
    } else if (!isSame(choice, site)) {
      return "not all numbers of the pixel change together";
    }
    image.kept.push_back(number);
    values.push_back(choice.value);
  }
  return nullptr;
}

/// Whether each number of the key is kept as it was compared.
static bool keepsKey(const KeyReader &reader, const Selection::Image &image,
                     ArrayRef<Value> values) {
  for (auto [number, value] : llvm::zip(reader.key.numbers, reader.values)) {
    const int64_t *kept = llvm::find(image.kept, int64_t(number.number));
    if (kept == image.kept.end() || values[kept - image.kept.begin()] != value)
      return false;
  }
  return true;
}

bool SelectionFinder::refuse(Operation *at, const char *why) {
  reason = Reason{at->getLoc(), why};
  return false;
}

bool SelectionFinder::addSite(UpdateOp update) {
  Selection selection;
  Selection::Site site{update, Value()};
  SmallVector<Value> values;
  if (const char *why = readSite(site, selection.images.emplace_back(), values))
    return refuse(update, why);
  if (selection.images.front().kept.empty())
    return refuse(update, "this reads the pixel");
  for (Operation &op : update.getBody().front())
    for (Region &region : op.getRegions())
      if (!visitBranch(region, /*carried=*/nullptr))
        return false;
  // What overwrites it anyway is the last.
  selection.key.last = true;
  if (site.condition && dependsOnPixel(site.condition, update)) {
    KeyReader reader(update);
    if (!reader.read(site.condition, site.outcome))
      return refuse(update, reader.why);
    if (!keepsKey(reader, selection.images.front(), values))
      return refuse(update, "the pixel keeps something else than what is "
                            "compared with it");
    selection.key = reader.key;
  }
  selection.sites.push_back(site);
  return findCarried(selection) && merge(selection);
}

bool SelectionFinder::merge(const Selection &selection) {
  for (Selection &known : selections) {
    if (known.images.front().name != selection.images.front().name)
      continue;
    if (known.key != selection.key || known.images != selection.images)
      return refuse(selection.sites.front().update,
                    "another update selects pixels of this image by another "
                    "key, or keeps other numbers");
    llvm::append_range(known.sites, selection.sites);
    llvm::append_range(known.carried, selection.carried);
    return true;
  }
  selections.push_back(selection);
  return true;
}

//===----------------------------------------------------------------------===//
// What depends on being first so far
//===----------------------------------------------------------------------===//

/// Whether an operation may be done for what is not first in the end: it only
/// computes, and cannot fail.
bool SelectionFinder::isFree(Operation *op, Region &region) const {
  if (auto load = dyn_cast<LoadOp>(op))
    return (load.getChecked() || load.getIndices().empty()) &&
           !names.contains(load.getStateAttr().getAttr());
  if (isa<scf::IfOp, scf::IndexSwitchOp, scf::ForOp, scf::WhileOp,
          memref::LoadOp>(op))
    return true;
  if (auto store = dyn_cast<memref::StoreOp>(op))
    return llvm::all_of(store.getMemref().getUsers(), [&](Operation *user) {
      return region.isAncestor(user->getParentRegion());
    });
  return isa<memref::AllocaOp>(op) ||
         (op->getNumRegions() == 0 && !isa<DivideOp>(op) &&
          isMemoryEffectFree(op));
}

/// Where an update has kept new numbers so far, if `carried` is given, or where
/// it has not.
bool SelectionFinder::visitBranch(Region &region,
                                  SmallVectorImpl<UpdateOp> *carried) {
  return !region
              .walk<WalkOrder::PreOrder>([&](Operation *op) {
                auto update = dyn_cast<UpdateOp>(op);
                if (update && carried && update->getParentRegion() == &region) {
                  carried->push_back(update);
                  return WalkResult::skip();
                }
                if (update ? refuse(op, "whether this pixel changes depends on "
                                        "more than on the first test")
                           : isFree(op, region) ||
                                 refuse(op, "this may fail, or shows, where "
                                            "something else is first in the "
                                            "end"))
                  return WalkResult::advance();
                return WalkResult::interrupt();
              })
              .wasInterrupted();
}

bool SelectionFinder::visitUses(Value isKept, bool outcome,
                                SmallVectorImpl<UpdateOp> &carried) {
  for (Operation *user : isKept.getUsers()) {
    if (isa<arith::XOrIOp>(user) && getNegated(user->getResult(0)) == isKept) {
      if (!visitUses(user->getResult(0), !outcome, carried))
        return false;
      continue;
    }
    auto branch = dyn_cast<scf::IfOp>(user);
    if (!branch || !branch.use_empty())
      return refuse(user, "this depends on what was first so far");
    if (!visitBranch(branch.getThenRegion(), outcome ? &carried : nullptr) ||
        !visitBranch(branch.getElseRegion(), outcome ? nullptr : &carried))
      return false;
  }
  return true;
}

/// Adds numbers of an image; false if some are there.
static bool addKept(Selection &selection, const Selection::Image &image) {
  for (Selection::Image &known : selection.images) {
    if (known.name != image.name)
      continue;
    llvm::append_range(known.kept, image.kept);
    llvm::sort(known.kept);
    return std::adjacent_find(known.kept.begin(), known.kept.end()) ==
           known.kept.end();
  }
  selection.images.push_back(image);
  return true;
}

bool SelectionFinder::findCarried(Selection &selection) {
  const Selection::Site &site = selection.sites.front();
  UpdateOp update = site.update;
  auto yield = cast<YieldOp>(update.getBody().front().getTerminator());
  SmallVector<UpdateOp> carried;
  for (auto [result, value] :
       llvm::zip(update.getResults(), yield.getResults())) {
    if (result.use_empty() || !dependsOnPixel(value, update))
      continue;
    if (!site.condition ||
        (value != site.condition && getNegated(value) != site.condition))
      return refuse(update, "what the pixel was is used elsewhere");
    bool outcome = (value == site.condition) == site.outcome;
    if (!visitUses(result, outcome, carried))
      return false;
  }
  for (UpdateOp other : carried) {
    Selection::Site overwritten{other, Value()};
    Selection::Image image;
    SmallVector<Value> values;
    if (const char *why = readSite(overwritten, image, values))
      return refuse(other, why);
    if (overwritten.condition ||
        !llvm::all_of(other.getResults(),
                      [](Value result) { return result.use_empty(); }))
      return refuse(other, "this reads the pixel");
    if (!llvm::equal(other.getCoordinates(), update.getCoordinates()))
      return refuse(other, "this may be another pixel than the one tested");
    if (!addKept(selection, image))
      return refuse(other, "this number is updated twice");
    after.insert(other);
    selection.carried.push_back(other);
  }
  // The same for each site.
  llvm::sort(MutableArrayRef(selection.images).drop_front(),
             [](const Selection::Image &a, const Selection::Image &b) {
               return a.name.getValue() < b.name.getValue();
             });
  return true;
}

//===----------------------------------------------------------------------===//
// The kernel
//===----------------------------------------------------------------------===//

/// Whether nothing else uses the images. Whatever else there is may be changed
/// by concurrent calls.
bool SelectionFinder::checkOthers() {
  return !kernel
              .walk([&](Operation *op) {
                const char *why = nullptr;
                StringAttr state;
                if (FlatSymbolRefAttr accessed = getStateAccess(op).first)
                  state = accessed.getAttr();
                if (isa<CheckCallOp>(op))
                  why = "checking mode runs each bin on one thread";
                else if (isa<LocalBinOp>(op))
                  why = "another stage runs when the bin is finished";
                else if (state && names.contains(state) && !isa<UpdateOp>(op))
                  why = "this uses an image that is updated, too";
                if (!why)
                  return WalkResult::advance();
                refuse(op, why);
                return WalkResult::interrupt();
              })
              .wasInterrupted();
}

void piko::appendImages(InFlightDiagnostic &remark,
                        const Selection &selection) {
  for (const Selection::Image &image : selection.images)
    remark << (&image == selection.images.begin() ? " '" : ", '")
           << image.name.getValue() << "'";
}

bool piko::hasOneOrderedBin(StageOp stage) {
  return llvm::all_of(stage.getBins(),
                      [](int64_t extent) { return extent == 0; }) &&
         stage.getOrdered() && !stage.getTile() && !stage.getTakesList();
}

bool SelectionFinder::find() {
  kernel.walk([&](UpdateOp update) {
    StringAttr image = update.getImageAttr().getAttr();
    names.insert(image);
    if (!others.contains(image))
      updates.push_back(update);
  });
  if (!checkOthers())
    return false;
  for (UpdateOp update : updates)
    if (!after.contains(update) && !addSite(update))
      return false;
  llvm::DenseSet<StringAttr> known;
  for (const Selection &selection : selections)
    for (const Selection::Image &image : selection.images)
      if (!known.insert(image.name).second)
        return refuse(selection.sites.front().update,
                      "an image that changes here changes elsewhere without "
                      "this test");
  return true;
}
