// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#include "Deferral/Deferral.h"

#include "Deferral/SplitUpdate.h"
#include "Support/StateAccess.h"

#include "Piko/Analysis/Expectations.h"
#include "Piko/Dialect/Piko/IR/BinArithmetic.h"
#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/Interfaces/LoopLikeInterface.h"

using namespace mlir;
using namespace piko;

Deferral::Deferral(BinsOp bins, Operation *work, ArrayRef<Site> sites, To to,
                   bool mayFail)
    : bin(bins.getBin()), work(work), sites(sites), to(to), mayFail(mayFail),
      stage(lookupInPipeline<StageOp>(bins, bins.getStageAttr())),
      written(getWrittenState(bins->getParentOp())), slice(makeRules()) {}

UpdateOp Deferral::getLast(size_t site) const {
  UpdateOp last = sites[site].updates.front();
  for (UpdateOp update : sites[site].updates)
    if (last->isBeforeInBlock(update))
      last = update;
  return last;
}

//===----------------------------------------------------------------------===//
// What can be done later
//===----------------------------------------------------------------------===//

bool Deferral::isInWork(Value value) const {
  return work->isAncestor(value.getParentRegion()->getParentOp());
}

/// A number before it was converted from one kind of integer to a wider one.
static Value stripCast(Value value) {
  Operation *op = value.getDefiningOp();
  bool isWider =
      isa_and_nonnull<arith::ExtSIOp>(op) ||
      (isa_and_nonnull<arith::IndexCastOp>(op) && value.getType().isIndex());
  return isWider ? op->getOperand(0) : Value();
}

bool Deferral::isCoordinate(const Counterparts &values, int64_t dim) const {
  for (auto [value, site] : llvm::zip(values, sites)) {
    Value coordinate = site.getCoordinates()[dim];
    while (coordinate && coordinate != value)
      coordinate = stripCast(coordinate);
    if (!coordinate)
      return false;
  }
  return true;
}

/// Whether counterparts are known later, without being kept. What a kernel
/// computes around its work, another one computes again.
bool Deferral::isKnown(const Counterparts &values) const {
  for (int64_t dim = 0, e = stage.getBins().size(); dim < e; ++dim)
    if (isCoordinate(values, dim))
      return true;
  return llvm::all_equal(values) &&
         (to == To::Bin ? !isInWork(values.front()) : values.front() == bin);
}

static bool holdsLoop(Operation *op) {
  return op
      ->walk([](Operation *inner) {
        return isa<LoopLikeOpInterface>(inner) ? WalkResult::interrupt()
                                               : WalkResult::advance();
      })
      .wasInterrupted();
}

/// Whether a loop over pixels stands after an operation, outside of which that
/// computes once what all of them take: after the work each would do so for
/// itself.
bool Deferral::isShared(Operation *op) const {
  for (const Site &site : sites)
    for (Operation *at = site.updates.front()->getParentOp(); at != work;
         at = at->getParentOp())
      if (isa<LoopLikeOpInterface, ParallelLoopOpInterface>(at))
        if (Operation *loop = op->getBlock()->findAncestorOpInBlock(*at))
          if (loop != op && op->isBeforeInBlock(loop))
            return true;
  return false;
}

/// Whether a read is known to be inside.
static bool isChecked(LoadOp load) {
  return load.getChecked() || load.getIndices().empty();
}

/// Whether an operation by itself computes the same later: from numbers, and
/// from state that the kernel leaves as it is. A kernel of its own knows of no
/// primitive, so that nothing may fail there.
bool Deferral::isFree(Operation *op) const {
  if (auto load = dyn_cast<LoadOp>(op))
    return !written.contains(load.getStateAttr().getAttr()) &&
           (mayFail || isChecked(load));
  if (op->getNumRegions() > 0)
    return isa<scf::IfOp, scf::IndexSwitchOp, scf::ForOp, scf::WhileOp>(op);
  return isMemoryEffectFree(op);
}

/// Whether an operation, with all that it holds, may be done later.
bool Deferral::isMovable(Operation *op) const {
  if (auto load = dyn_cast<LoadOp>(op); load && isOfItem(load))
    return false;
  if (holdsLoop(op) && isShared(op))
    return false;
  return !op->walk([&](Operation *inner) {
              return isFree(inner) ? WalkResult::advance()
                                   : WalkResult::interrupt();
            }).wasInterrupted();
}

/// Whether all pixels of a primitive read the same: after the work each pixel
/// would read it for itself.
bool Deferral::isOfItem(LoadOp load) const {
  Operation *loop = nullptr;
  for (Operation *at = load->getParentOp(); at && at != work;
       at = at->getParentOp())
    if (isa<LoopLikeOpInterface, ParallelLoopOpInterface>(at))
      loop = at;
  auto isSame = [&](Value index) {
    return !loop->isAncestor(index.getParentRegion()->getParentOp());
  };
  return loop && !load.getIndices().empty() &&
         llvm::all_of(load.getIndices(), isSame) &&
         llvm::any_of(load.getIndices(),
                      [&](Value index) { return isInWork(index); });
}

/// About how many instructions an operation is, by its kind.
static double getCost(Operation *op) {
  if (isa<arith::DivFOp, math::SqrtOp>(op))
    return 8;
  if (op->getDialect()->getNamespace() == "math" &&
      !isa<math::AbsFOp, math::FmaOp>(op))
    return 20;
  double cost = op->getNumRegions() == 0;
  for (Region &region : op->getRegions())
    for (Operation &inner : region.getOps())
      cost += getCost(&inner);
  return isa<LoopLikeOpInterface>(op)
             ? cost * getExpectedIterations(op).value_or(expected::iterations)
             : cost;
}

static double getCost(ArrayRef<Operation *> ops) {
  double cost = 0;
  for (Operation *op : ops)
    cost += getCost(op);
  return cost;
}

/// Those of a slice that nothing else than it and its roots needs: where it has
/// moved, they are gone. What is used is before its users.
static SmallVector<Operation *>
findGone(ArrayRef<Operation *> slice,
         llvm::function_ref<bool(Operation *)> isRoot) {
  llvm::SmallPtrSet<Operation *, 32> gone(slice.begin(), slice.end());
  auto isGone = [&](Operation *user) {
    if (isRoot(user))
      return true;
    while (user && !gone.contains(user))
      user = user->getParentOp();
    return user != nullptr;
  };
  SmallVector<Operation *> found;
  for (Operation *op : llvm::reverse(slice))
    if (llvm::all_of(op->getUsers(), isGone))
      found.push_back(op);
    else
      gone.erase(op);
  return found;
}

/// Whether a pixel that primitives overwrite takes longer than one for which so
/// many numbers are kept: `gone` is what each of them no longer does, `moved`
/// what is done for the pixel.
static bool isWorthwhile(ArrayRef<Operation *> gone,
                         ArrayRef<Operation *> moved, int64_t numbers,
                         Deferral::To to) {
  // What is stored and read again for a number, in the second level or beyond;
  // and a pixel's iteration of the loop.
  bool isNear = to == Deferral::To::Bin;
  int64_t perNumber = isNear ? 6 : 12, perPixel = isNear ? 64 : 96;
  return expected::overwrites * getCost(gone) >
         getCost(moved) + double(perPixel + perNumber * numbers);
}

CommonSlice::Rules Deferral::makeRules() {
  return {
      .isKnown = [this](const Counterparts &values) { return isKnown(values); },
      .isMovable = [this](Operation *op) { return isMovable(op); },
      .mustMove =
          [this](Operation *op) {
            return hasLoops ? holdsLoop(op) : getCost(op) > 1;
          }};
}

/// Moves reads of a primitive's fields out of what may move: after the work
/// there are no primitives.
static void hoistFields(const Site &site) {
  for (Operation &op : *site.updates.front()->getBlock()) {
    if (op.getNumRegions() == 0 || isa<UpdateOp>(op))
      continue;
    SmallVector<GetOp> reads;
    op.walk([&](GetOp read) {
      if (isSpeculatable(read) &&
          llvm::all_of(read->getOperands(), [&](Value operand) {
            return !op.isAncestor(operand.getParentRegion()->getParentOp());
          }))
        reads.push_back(read);
    });
    for (GetOp read : reads)
      read->moveBefore(&op);
  }
}

/// Whether the stage's bins let it be done there.
static bool isPossible(StageOp stage, Deferral::To to) {
  return to == Deferral::To::Kernel || !whyNotOneThread(stage);
}

bool Deferral::findWork() {
  if (isPossible(stage, to))
    for (const Site &site : sites)
      hoistFields(site);
  for (size_t image = 0; image < sites.front().updates.size(); ++image) {
    SmallVector<Operation *> updates;
    for (const Site &site : sites) {
      updates.push_back(site.updates[image]);
      for (Operation &op : updates.back()->getRegion(0).getOps())
        if (!isMovable(&op) && !isa<YieldOp>(op))
          return false;
    }
    if (!slice.addRoot(updates))
      return false;
  }
  hasLoops = llvm::any_of(slice.getOperations(), holdsLoop);
  if (!slice.cut() || !canStore())
    return false;
  SmallVector<Operation *> moved = slice.getMoved();
  auto isUpdate = [&](Operation *user) {
    return llvm::any_of(sites.front().updates, [&](UpdateOp update) {
      return update->isAncestor(user);
    });
  };
  return isWorthwhile(findGone(moved, isUpdate), moved, slice.getKept().size(),
                      to);
}

llvm::DenseSet<StringAttr> Deferral::getImages() const {
  llvm::DenseSet<StringAttr> images;
  for (UpdateOp update : sites.front().updates)
    images.insert(update.getImageAttr().getAttr());
  return images;
}

llvm::DenseSet<StringAttr> Deferral::getReadState() const {
  llvm::DenseSet<StringAttr> read;
  for (Operation *op : slice.getMoved())
    op->walk([&](LoadOp load) { read.insert(load.getStateAttr().getAttr()); });
  return read;
}

//===----------------------------------------------------------------------===//
// What is kept
//===----------------------------------------------------------------------===//

/// In what a number is stored: truth values take a word, as vectors of bits
/// have no masked stores, and indices have a size; null if it is too wide.
static Type getStoredType(Type type) {
  MLIRContext *context = type.getContext();
  if (type.isInteger(1))
    return IntegerType::get(context, 32);
  if (type.isIndex())
    return IntegerType::get(context, 64);
  if (auto integer = dyn_cast<IntegerType>(type)) {
    unsigned width = llvm::PowerOf2Ceil(std::max(8u, integer.getWidth()));
    return width > 64 ? Type() : Type(IntegerType::get(context, width));
  }
  return type.isF32() || type.isF64() ? type : Type();
}

bool Deferral::canStore() const {
  return llvm::all_of(slice.getKept(), [](const Counterparts &values) {
    return bool(getStoredType(values.front().getType()));
  });
}

SmallVector<Type> Deferral::getStoredTypes() const {
  SmallVector<Type> types;
  for (const Counterparts &values : slice.getKept())
    types.push_back(getStoredType(values.front().getType()));
  return types;
}

int64_t Deferral::getBytes() const {
  int64_t bytes = sizeof(int32_t); // whether there is anything
  for (Type type : getStoredTypes())
    bytes += type.getIntOrFloatBitWidth() / 8;
  return bytes;
}

SmallVector<Value> Deferral::store(OpBuilder &builder, size_t site) const {
  SmallVector<Value> stored;
  for (const Counterparts &values : slice.getKept()) {
    Value value = values[site];
    Location loc = value.getLoc();
    Type type = getStoredType(value.getType());
    if (value.getType().isIndex())
      value = arith::IndexCastOp::create(builder, loc, type, value);
    else if (type != value.getType())
      value = arith::ExtUIOp::create(builder, loc, type, value);
    stored.push_back(value);
  }
  return stored;
}

/// A coordinate at which the pixel is known later, or the bin that it is in.
Value Deferral::getKnown(OpBuilder &builder, const Counterparts &values,
                         ValueRange pixel) const {
  Value known = values.front();
  Type type = known.getType();
  for (auto [dim, at] : llvm::enumerate(pixel)) {
    if (!isCoordinate(values, dim))
      continue;
    if (type == at.getType())
      return at;
    if (type.isIndex())
      return arith::IndexCastOp::create(builder, at.getLoc(), type, at);
    if (type.getIntOrFloatBitWidth() < 32)
      return arith::TruncIOp::create(builder, at.getLoc(), type, at);
    return arith::ExtSIOp::create(builder, at.getLoc(), type, at);
  }
  if (to == To::Bin)
    return known;
  return BinArithmetic(builder, known.getLoc(), stage).binAt(pixel);
}

/// Does the rest for a pixel.
void Deferral::rebuild(OpBuilder &builder, ValueRange pixel, Load load) const {
  SmallVector<Value> kept;
  for (auto [number, values] : llvm::enumerate(slice.getKept())) {
    Value value = load(pixel, number);
    Type type = values.front().getType();
    if (type.isIndex())
      value = arith::IndexCastOp::create(builder, value.getLoc(), type, value);
    else if (type != value.getType())
      value = arith::TruncIOp::create(builder, value.getLoc(), type, value);
    kept.push_back(value);
  }
  slice.rebuild(
      builder,
      [&](const Counterparts &values) {
        return getKnown(builder, values, pixel);
      },
      kept);
}

void Deferral::createLoop(OpBuilder &builder, StageOp owner, Value bin,
                          Load load) const {
  Location loc = work->getLoc();
  BinArithmetic cells(builder, loc, owner);
  SmallVector<Value> lo, hi;
  auto toCoordinate = [&](Value value) {
    return arith::IndexCastOp::create(builder, loc, builder.getI32Type(),
                                      value);
  };
  for (int64_t dim = 0; dim < cells.rank(); ++dim) {
    lo.push_back(toCoordinate(cells.lo(bin, dim)));
    hi.push_back(toCoordinate(cells.hi(bin, dim)));
  }
  auto pixels = ParallelPixelsOp::create(builder, loc, lo, hi);
  Block &body = pixels.getBody().emplaceBlock();
  for (Value at : lo)
    body.addArgument(at.getType(), loc);
  builder.setInsertionPointToStart(&body);
  Value isKept = load(body.getArguments(), std::nullopt);
  Value no = arith::ConstantIntOp::create(builder, loc, 0, 32);
  Value test =
      arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::ne, isKept, no);
  auto choice = scf::IfOp::create(builder, loc, test, /*withElse=*/false);
  YieldOp::create(builder, loc, ValueRange(), ValueRange());
  builder.setInsertionPointToStart(choice.thenBlock());
  rebuild(builder, body.getArguments(), load);
}

//===----------------------------------------------------------------------===//
// All of a kernel
//===----------------------------------------------------------------------===//

/// The first read that is done later and may fail.
LoadOp Deferral::findFailure() const {
  LoadOp found;
  for (Operation *op : slice.getMoved())
    op->walk([&](LoadOp load) {
      if (!found && !isChecked(load))
        found = load;
    });
  return found;
}

/// Why nothing can be deferred that could be if it may fail, or if there were
/// but one site.
static std::optional<Reason> whyNotAll(BinsOp bins, Operation *work,
                                       ArrayRef<Site> sites, Deferral::To to) {
  if (Deferral deferral(bins, work, sites, to, /*mayFail=*/true);
      deferral.findWork())
    if (LoadOp load = deferral.findFailure())
      return Reason{load.getLoc(),
                    "the index of this read is not proved to be inside, and "
                    "would not be tested where it is overwritten; compare it "
                    "with the size in front"};
  if (sites.size() == 1 ||
      !Deferral(bins, work, sites.take_front(), to).findWork())
    return std::nullopt;
  return Reason{UpdateOp(sites[1].updates.front()).getLoc(),
                "this does not do the same as the update before; let both end "
                "in one computation, as in a function that both call"};
}

/// What is in the way in the stage's bins, or at a site.
static std::optional<Reason> whyNotHere(StageOp stage, ArrayRef<Site> sites,
                                        Deferral::To to) {
  if (!isPossible(stage, to))
    return whyNotOneThread(stage);
  for (const Site &site : sites)
    for (UpdateOp update : site.updates)
      if (!update->hasAttr(marks::inside))
        return Reason{update.getLoc(),
                      "this pixel is not proved to be in the bin; take one of "
                      "parallelForPixels"};
  return std::nullopt;
}

/// Takes apart what tests pixels and overwrites them.
static void splitUpdates(BinsOp bins, Deferral::To to) {
  SmallVector<UpdateOp> updates;
  bins.walk([&](UpdateOp update) { updates.push_back(update); });
  for (UpdateOp update : updates)
    splitUpdate(update, [&](ArrayRef<Operation *> work) {
      // What the test needs stays, whatever yields it as well.
      auto isYield = [&](Operation *user) {
        return user->hasTrait<OpTrait::IsTerminator>() &&
               update->isAncestor(user);
      };
      SmallVector<Operation *> gone = findGone(work, isYield);
      return isWorthwhile(gone, gone, 0, to);
    });
}

void piko::forEachDeferral(
    KernelOp kernel, BinsOp bins, Deferral::To to,
    llvm::function_ref<std::optional<Reason>(Deferral &)> apply) {
  auto stage = lookupInPipeline<StageOp>(bins, bins.getStageAttr());
  if (isPossible(stage, to))
    splitUpdates(bins, to);
  for (const SmallVector<Site> &sites : findSites(kernel)) {
    Operation *work = findOverwritingWork(bins, sites);
    if (!work || (sites.size() == 1 && overwritesOnce(work, sites.front())))
      continue;
    UpdateOp update = sites.front().updates.front();
    Location loc = update.getLoc();
    std::string image = update.getImage().str();
    Deferral deferral(bins, work, sites, to);
    std::optional<Reason> reason;
    if (!deferral.findWork()) {
      if (!(reason = whyNotAll(bins, work, sites, to)))
        continue;
    } else if (!(reason = whyNotHere(stage, sites, to))) {
      reason = apply(deferral);
    }
    if (!reason)
      continue;
    InFlightDiagnostic remark = mlir::emitRemark(loc)
                                << "what is written to '" << image
                                << "' is computed also where it is overwritten";
    remark.attachNote(reason->at) << reason->why;
  }
}
