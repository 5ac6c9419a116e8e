// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko-defer-shading, for the work of each kernel over bins:
//   1. find the updates that overwrite pixels of images which the kernel does
//      not read: of all that a bin's primitives write there, the last is seen;
//   2. find what all of them compute alike, and where to cut it, so that little
//      has to be kept for each pixel;
//   3. keep that in place of the updates, and do the rest in a loop over the
//      bin's pixels behind the work.

#include "BinOwner.h"
#include "CommonSlice.h"
#include "PaintedPixels.h"
#include "SplitUpdate.h"
#include "StateAccess.h"

#include "Piko/Dialect/Piko/IR/BinArithmetic.h"
#include "Piko/Dialect/Piko/IR/CppTypes.h"
#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Transforms/Passes.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/Math/IR/Math.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/Interfaces/LoopLikeInterface.h"

namespace piko {
#define GEN_PASS_DEF_DEFERSHADING
#include "Piko/Transforms/Passes.h.inc"
} // namespace piko

using namespace mlir;
using namespace piko;

namespace {

struct DeferShadingPass : piko::impl::DeferShadingBase<DeferShadingPass> {
  using DeferShadingBase::DeferShadingBase;
  void runOnOperation() override;
  void runOnBins(KernelOp kernel, BinsOp bins);
};

/// Moves what some images are painted with behind the work that paints them.
class Deferral {
public:
  Deferral(BinsOp bins, Operation *work, ArrayRef<Site> sites)
      : bins(bins), work(work), sites(sites),
        stage(lookupInPipeline<StageOp>(bins, bins.getStageAttr())),
        written(getWrittenState(bins->getParentOp())), slice(makeRules()) {}

  bool findWork();
  std::optional<Reason> whyNot(int64_t budget);
  void apply();
  /// The bytes kept for a pixel.
  int64_t getBytes() const;

private:
  CommonSlice::Rules makeRules();
  bool isInWork(Value value) const;
  bool isCoordinate(const Counterparts &values, int64_t dim) const;
  bool isMovable(Operation *op) const;
  bool isOfItem(LoadOp load) const;
  bool isShared(Operation *op) const;
  int64_t getPixels() const;
  Value getPlace(OpBuilder &builder, Location loc, ValueRange coordinates);
  Value getKnown(OpBuilder &builder, const Counterparts &values,
                 ValueRange cell) const;
  void createArrays();
  void keepAt(size_t site);
  void createLoop();

  BinsOp bins;
  Operation *work;
  ArrayRef<Site> sites;
  mutable StageOp stage;
  llvm::DenseSet<StringAttr> written; ///< State that the kernel changes.
  bool hasLoops = false;              ///< Loops are what is worth moving.
  CommonSlice slice;
  SmallVector<Value> first;  ///< The bin's first cell.
  Value isPainted;           ///< By pixel, whether anything is kept.
  SmallVector<Value> arrays; ///< By pixel, what is kept.
};

} // namespace

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

static bool holdsLoop(Operation *op) {
  return op
      ->walk([](Operation *inner) {
        return isa<LoopLikeOpInterface>(inner) ? WalkResult::interrupt()
                                               : WalkResult::advance();
      })
      .wasInterrupted();
}

/// Whether a loop over pixels stands behind an operation, outside of which that
/// computes once what all of them take: behind the work each would do so for
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

/// Whether an operation, with all that it holds, computes the same behind the
/// work: from numbers, and from state that the kernel leaves as it is.
bool Deferral::isMovable(Operation *op) const {
  if (auto load = dyn_cast<LoadOp>(op); load && isOfItem(load))
    return false;
  if (holdsLoop(op) && isShared(op))
    return false;
  return !op->walk([&](Operation *inner) {
              auto load = dyn_cast<LoadOp>(inner);
              bool isFree =
                  load ? !written.contains(load.getStateAttr().getAttr())
                  : inner->getNumRegions() > 0
                      ? isa<scf::IfOp, scf::IndexSwitchOp, scf::ForOp,
                            scf::WhileOp>(inner)
                      : isMemoryEffectFree(inner);
              return isFree ? WalkResult::advance() : WalkResult::interrupt();
            }).wasInterrupted();
}

/// Whether all pixels of a primitive read the same: behind the work each pixel
/// would read it for itself.
bool Deferral::isOfItem(LoadOp load) const {
  Operation *loop = nullptr;
  for (Operation *at = load->getParentOp(); at != work; at = at->getParentOp())
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
static int64_t getCost(Operation *op) {
  if (isa<arith::DivFOp, math::SqrtOp>(op))
    return 8;
  if (op->getDialect()->getNamespace() == "math" &&
      !isa<math::AbsFOp, math::FmaOp>(op))
    return 20;
  int64_t cost = op->getNumRegions() == 0;
  for (Region &region : op->getRegions())
    for (Operation &inner : region.getOps())
      cost += getCost(&inner);
  constexpr int64_t turns = 16;
  return isa<LoopLikeOpInterface>(op) ? turns * cost : cost;
}

/// Whether computing for each pixel takes longer than keeping so many numbers.
static bool isWorthwhile(ArrayRef<Operation *> ops, int64_t numbers) {
  int64_t cost = 0;
  for (Operation *op : ops)
    cost += getCost(op);
  // What is stored and read again for a number; and a pixel's turn of the loop.
  constexpr int64_t perNumber = 6, perPixel = 64;
  return cost > perPixel + perNumber * numbers;
}

CommonSlice::Rules Deferral::makeRules() {
  return {.isKnown =
              [this](const Counterparts &values) {
                for (int64_t dim = 0, e = stage.getBins().size(); dim < e;
                     ++dim)
                  if (isCoordinate(values, dim))
                    return true;
                return llvm::all_equal(values) && !isInWork(values.front());
              },
          .isMovable = [this](Operation *op) { return isMovable(op); },
          .mustMove =
              [this](Operation *op) {
                return hasLoops ? holdsLoop(op) : getCost(op) > 1;
              }};
}

/// Moves reads of a primitive's fields out of what may move: behind the work
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

/// Finds what is to be done later; false if it is too little, or if that cannot
/// be told apart.
bool Deferral::findWork() {
  if (!whyNotOneThread(stage))
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
  if (!slice.cut())
    return false;
  return isWorthwhile(slice.getMoved(), slice.getKept().size());
}

//===----------------------------------------------------------------------===//
// What is in the way
//===----------------------------------------------------------------------===//

int64_t Deferral::getPixels() const {
  constexpr int64_t most = int64_t(1) << 40;
  int64_t pixels = 1;
  for (int64_t extent : stage.getBins())
    pixels = std::min(most, pixels * std::min(extent, most / pixels + 1));
  return pixels;
}

/// What is stored for a value: truth values take a word, as vectors of bits
/// have no masked stores.
static Type getStoredType(Type type) {
  return type.isInteger(1) ? IntegerType::get(type.getContext(), 32) : type;
}

int64_t Deferral::getBytes() const {
  int64_t bytes = sizeof(int32_t);
  for (const Counterparts &values : slice.getKept()) {
    Type type = getStoredType(values.front().getType());
    bytes += type.isIndex() ? 8 : type.getIntOrFloatBitWidth() / 8;
  }
  return bytes;
}

std::optional<Reason> Deferral::whyNot(int64_t budget) {
  if (std::optional<Reason> reason = whyNotOneThread(stage))
    return reason;
  for (const Site &site : sites)
    for (UpdateOp update : site.updates)
      if (!update->hasAttr(marks::inside))
        return Reason{update.getLoc(),
                      "this pixel is not proved to be in the bin; take one of "
                      "parallelForPixels"};
  if (int64_t bytes = getBytes() * getPixels(); bytes > budget)
    return Reason{stage.getLoc(),
                  "what is kept of a bin may have " + std::to_string(budget) +
                      " bytes, but this has " + std::to_string(bytes) +
                      "; give the stage smaller bins"};
  return std::nullopt;
}

//===----------------------------------------------------------------------===//
// Forming
//===----------------------------------------------------------------------===//

/// The number of a pixel among those of the bin.
Value Deferral::getPlace(OpBuilder &builder, Location loc,
                         ValueRange coordinates) {
  Value place;
  for (int64_t dim = stage.getBins().size(); dim-- > 0;) {
    Value at = coordinates[dim];
    if (!at.getType().isIndex())
      at = arith::IndexCastOp::create(builder, loc, builder.getIndexType(), at);
    at = arith::SubIOp::create(builder, loc, at, first[dim]);
    if (place) {
      Value extent =
          arith::ConstantIndexOp::create(builder, loc, stage.getBins()[dim]);
      at = arith::AddIOp::create(
          builder, loc, at, arith::MulIOp::create(builder, loc, place, extent));
    }
    place = at;
  }
  return place;
}

/// Makes the arrays of what is kept. No pixel is marked.
void Deferral::createArrays() {
  Location loc = work->getLoc();
  OpBuilder builder(work);
  BinArithmetic cells(builder, loc, stage);
  for (int64_t dim = 0; dim < cells.rank(); ++dim)
    first.push_back(cells.lo(bins.getBin(), dim));
  auto createArray = [&](Type type) -> Value {
    constexpr int64_t lineSize = 64;
    auto array = memref::AllocaOp::create(builder, loc,
                                          MemRefType::get({getPixels()}, type),
                                          builder.getI64IntegerAttr(lineSize));
    array->setAttr(
        marks::pixels,
        UpdateOp(sites.front().updates.front()).getImageAttr().getAttr());
    return array;
  };
  isPainted = createArray(builder.getI32Type());
  for (const Counterparts &values : slice.getKept())
    arrays.push_back(createArray(getStoredType(values.front().getType())));
  auto constant = [&](int64_t value) {
    return arith::ConstantIndexOp::create(builder, loc, value);
  };
  auto loop = scf::ForOp::create(builder, loc, constant(0),
                                 constant(getPixels()), constant(1));
  builder.setInsertionPointToStart(loop.getBody());
  Value no = arith::ConstantIntOp::create(builder, loc, 0, 32);
  memref::StoreOp::create(builder, loc, no, isPainted, loop.getInductionVar());
}

/// The value behind which all values are known.
static Value getInnermost(ValueRange values) {
  Value inner = values.front();
  for (Value value : values.drop_front()) {
    Block *block = value.getParentBlock();
    bool isBehind =
        block == inner.getParentBlock()
            ? value.getDefiningOp() && (!inner.getDefiningOp() ||
                                        inner.getDefiningOp()->isBeforeInBlock(
                                            value.getDefiningOp()))
            : inner.getParentRegion()->isAncestor(value.getParentRegion());
    if (isBehind)
      inner = value;
  }
  return inner;
}

/// Keeps, in place of the updates of a site, what they are computed from.
void Deferral::keepAt(size_t number) {
  const Site &site = sites[number];
  UpdateOp last = site.updates.front();
  for (UpdateOp update : site.updates)
    if (last->isBeforeInBlock(update))
      last = update;
  OpBuilder builder(last);
  Location loc = last.getLoc();
  // Sites that paint one pixel of a loop have one place, too.
  builder.setInsertionPointAfterValue(getInnermost(site.getCoordinates()));
  Value place = getPlace(builder, loc, site.getCoordinates());
  builder.setInsertionPoint(last);
  for (auto [values, array] : llvm::zip(slice.getKept(), arrays)) {
    Value value = values[number];
    if (Type type = getStoredType(value.getType()); type != value.getType())
      value = arith::ExtUIOp::create(builder, loc, type, value);
    memref::StoreOp::create(builder, loc, value, array, place);
  }
  Value yes = arith::ConstantIntOp::create(builder, loc, 1, 32);
  memref::StoreOp::create(builder, loc, yes, isPainted, place);
}

/// A coordinate at which the pixel of a site is known behind the work.
Value Deferral::getKnown(OpBuilder &builder, const Counterparts &values,
                         ValueRange cell) const {
  Value known = values.front();
  Type type = known.getType();
  for (auto [dim, at] : llvm::enumerate(cell)) {
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
  return known;
}

/// The loop over the pixels of the bin that does the rest.
void Deferral::createLoop() {
  Location loc = work->getLoc();
  OpBuilder builder(work->getContext());
  builder.setInsertionPointAfter(work);
  SmallVector<Value> lo, hi;
  auto toCoordinate = [&](Value value) {
    return arith::IndexCastOp::create(builder, loc, builder.getI32Type(),
                                      value);
  };
  BinArithmetic cells(builder, loc, stage);
  for (auto [dim, at] : llvm::enumerate(first)) {
    lo.push_back(toCoordinate(at));
    hi.push_back(toCoordinate(cells.hi(bins.getBin(), dim)));
  }
  auto pixels = ParallelPixelsOp::create(builder, loc, lo, hi);
  Block &body = pixels.getBody().emplaceBlock();
  for (size_t dim = 0; dim < first.size(); ++dim)
    body.addArgument(builder.getI32Type(), loc);
  builder.setInsertionPointToStart(&body);
  Value place = getPlace(builder, loc, body.getArguments());
  auto load = [&](Value array) -> Value {
    return memref::LoadOp::create(builder, loc, array, place);
  };
  Value no = arith::ConstantIntOp::create(builder, loc, 0, 32);
  Value test = arith::CmpIOp::create(builder, loc, arith::CmpIPredicate::ne,
                                     load(isPainted), no);
  auto choice = scf::IfOp::create(builder, loc, test, /*withElse=*/false);
  YieldOp::create(builder, loc, ValueRange(), ValueRange());
  builder.setInsertionPointToStart(choice.thenBlock());
  SmallVector<Value> values;
  for (auto [kept, array] : llvm::zip(slice.getKept(), arrays)) {
    Value value = load(array);
    if (Type type = kept.front().getType(); type != value.getType())
      value = arith::TruncIOp::create(builder, loc, type, value);
    values.push_back(value);
  }
  slice.rebuild(
      builder,
      [&](const Counterparts &known) {
        return getKnown(builder, known, body.getArguments());
      },
      values);
}

void Deferral::apply() {
  createArrays();
  for (size_t site = 0; site < sites.size(); ++site)
    keepAt(site);
  createLoop();
  for (const Site &site : sites)
    for (UpdateOp update : site.updates)
      update.erase();
}

//===----------------------------------------------------------------------===//
// The pass
//===----------------------------------------------------------------------===//

/// Why what could be deferred of one site alone cannot be of all.
static std::optional<Reason> whyNotAlike(BinsOp bins, Operation *work,
                                         ArrayRef<Site> sites) {
  if (sites.size() == 1 || !Deferral(bins, work, sites.take_front()).findWork())
    return std::nullopt;
  return Reason{UpdateOp(sites[1].updates.front()).getLoc(),
                "this does not do the same as the update before; let both end "
                "in one computation, as in a function that both call"};
}

void DeferShadingPass::runOnBins(KernelOp kernel, BinsOp bins) {
  if (!whyNotOneThread(lookupInPipeline<StageOp>(bins, bins.getStageAttr()))) {
    SmallVector<UpdateOp> updates;
    bins.walk([&](UpdateOp update) { updates.push_back(update); });
    for (UpdateOp update : updates)
      splitUpdate(update, [](ArrayRef<Operation *> work) {
        return isWorthwhile(work, 0);
      });
  }
  for (const SmallVector<Site> &sites : findSites(kernel)) {
    Operation *work = findPaintingWork(bins, sites);
    if (!work || (sites.size() == 1 && paintsOnce(work, sites.front())))
      continue;
    Deferral deferral(bins, work, sites);
    std::optional<Reason> reason;
    if (deferral.findWork())
      reason = deferral.whyNot(budget);
    else if (!(reason = whyNotAlike(bins, work, sites)))
      continue;
    UpdateOp update = sites.front().updates.front();
    std::string what = ("what is written to '" + update.getImage() + "'").str();
    if (reason) {
      InFlightDiagnostic remark =
          update.emitRemark()
          << what << " is computed also where it is overwritten";
      remark.attachNote(reason->at) << reason->why;
      ++refused;
      continue;
    }
    update.emitRemark() << what << " is computed once for each pixel, when all "
                        << "primitives of the bin are done, from "
                        << deferral.getBytes() << " bytes";
    deferral.apply();
    ++deferred;
  }
}

void DeferShadingPass::runOnOperation() {
  if (budget < 0) {
    getOperation().emitError("expected a budget of at least 0 bytes, but got ")
        << budget.getValue();
    return signalPassFailure();
  }
  for (auto kernel : getOperation().getOps<KernelOp>())
    for (auto bins : kernel.getOps<BinsOp>())
      runOnBins(kernel, bins);
}
