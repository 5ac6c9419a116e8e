// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Staged software prefetching for rows of pixels. Where a pixel reads a key, by
// it a triangle, and by that its corners, the corners of the next row are asked
// for, and the triangles of the one after it, whose numbers the stage for the
// corners reads. Each stage is a loop of its own, with a copy of what leads to
// the places it asks for, so that lanes share it as they do the pixels.
//
// Nothing is asked for pixels that refer to the same as those of the row
// before. There is no stage for buffers that the nearest caches hold (4 MiB),
// nor for what pixels read at their own place if it is less than 1 MiB: in
// larger images each row of a bin is on a page of its own, where no hardware
// prefetcher follows. What pixels refer to elsewhere in images is not followed.

#include "CPU/PrefetchRows.h"

#include "Support/StateAccess.h"

#include "Piko/Analysis/TargetModel.h"
#include "Piko/Dialect/Piko/IR/CodeBuilder.h"
#include "Piko/Dialect/Piko/IR/Marks.h"
#include "Piko/Dialect/Piko/IR/PikoCPU.h"

#include "mlir/IR/IRMapping.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"
#include "llvm/ADT/MapVector.h"
#include "llvm/ADT/SetVector.h"

using namespace mlir;
using namespace piko;

namespace {

/// A side of a condition.
using Guard = std::pair<Value, bool>;

/// An element that a pixel reads, of a buffer, and what is known to decide
/// whether it does.
struct RowReference {
  LoadOp load;
  SmallVector<Guard> guards;

  ValueRange getPlace() const { return LoadOp(load).getIndices(); }
};

/// References to one buffer that as many reads lead to.
using Stage = std::pair<int64_t, Attribute>;

class RowPrefetcher {
public:
  RowPrefetcher(scf::ForOp rows, scf::ForOp pixels)
      : rows(rows), pixels(pixels), written(getWrittenState(rows)) {}
  void run();

private:
  /// How many reads lead to a value, one after the other, or none if it cannot
  /// be computed for other rows.
  std::optional<int64_t> getDepth(Value value);
  std::optional<int64_t> computeDepth(Value value);
  bool isBuffer(LoadOp load) const {
    return load.getIndices().size() == 1 && !load.getTile() &&
           lookupInPipeline<BufferOp>(load, load.getStateAttr());
  }
  void findReferences();
  SmallVector<Guard> findGuards(LoadOp load, int64_t depth);
  /// Asks for what the pixels of a row refer to, all or those that refer to
  /// something else than their neighbours in the row before.
  void writeStage(const Stage &stage, Value row, bool isFirst,
                  OpBuilder &builder);
  Value isNew(OpBuilder &builder, IRMapping &mapping, Value row);
  Value isWorthwhile(const Stage &stage, OpBuilder &builder);
  Value clone(Value value, OpBuilder &builder, IRMapping &mapping);
  int64_t getDistance(const Stage &stage) const {
    return stages.back().first.first - stage.first + 1;
  }

  scf::ForOp rows, pixels;
  llvm::DenseSet<StringAttr> written;
  llvm::DenseMap<Value, std::optional<int64_t>> depths;
  llvm::DenseMap<Value, bool> differs; ///< from pixel to pixel
  llvm::SetVector<Attribute> tested;   ///< buffers that may be empty
  llvm::SetVector<LoadOp> roots;       ///< reads at the pixel itself
  llvm::MapVector<Stage, SmallVector<RowReference>> found;
  SmallVector<std::pair<Stage, SmallVector<RowReference>>> stages;
};

} // namespace

//===----------------------------------------------------------------------===//
// What leads to a place
//===----------------------------------------------------------------------===//

std::optional<int64_t> RowPrefetcher::getDepth(Value value) {
  if (rows.isDefinedOutsideOfLoop(value) || value == rows.getInductionVar())
    return 0;
  if (value == pixels.getInductionVar()) {
    differs[value] = true;
    return 0;
  }
  if (auto known = depths.find(value); known != depths.end())
    return known->second;
  std::optional<int64_t> depth = computeDepth(value);
  return depths[value] = depth;
}

std::optional<int64_t> RowPrefetcher::computeDepth(Value value) {
  Operation *op = value.getDefiningOp();
  if (!op || op->getNumRegions() != 0)
    return {};
  auto load = dyn_cast<LoadOp>(op);
  bool isTested = load && !load.getChecked() && !load.getIndices().empty();
  bool isKnown = load ? !written.contains(load.getStateAttr().getAttr()) &&
                            (!isTested || isBuffer(load))
                      : isPure(op);
  if (!isKnown)
    return {};
  if (isTested)
    tested.insert(load.getStateAttr());
  int64_t depth = 0;
  for (Value operand : op->getOperands()) {
    std::optional<int64_t> before = getDepth(operand);
    if (!before)
      return {};
    depth = std::max(depth, *before);
    differs[value] |= differs.lookup(operand);
  }
  if (!load || !differs.lookup(value))
    return depth;
  if (depth == 0)
    roots.insert(load);
  return depth + 1;
}

/// The conditions around a read that are known no later than its place.
SmallVector<Guard> RowPrefetcher::findGuards(LoadOp load, int64_t depth) {
  SmallVector<Guard> guards;
  for (Operation *at = load; at != pixels; at = at->getParentOp()) {
    auto choice = dyn_cast<scf::IfOp>(at->getParentOp());
    if (!choice)
      continue;
    std::optional<int64_t> known = getDepth(choice.getCondition());
    if (known && *known <= depth)
      guards.emplace_back(choice.getCondition(),
                          at->getParentRegion() == &choice.getThenRegion());
  }
  return guards;
}

void RowPrefetcher::findReferences() {
  constexpr int64_t deepest = 3;
  llvm::DenseSet<std::pair<Attribute, Value>> known;
  pixels.walk([&](LoadOp load) {
    if (!isBuffer(load) || written.contains(load.getStateAttr().getAttr()))
      return;
    Value place = load.getIndices().front();
    std::optional<int64_t> depth = getDepth(place);
    if (!depth || *depth == 0 || *depth > deepest ||
        !known.insert({load.getStateAttr(), place}).second)
      return;
    found[{*depth, load.getStateAttr()}].push_back(
        {load, findGuards(load, *depth)});
  });
  if (found.empty())
    return;
  for (LoadOp root : roots)
    if (!root.getTile())
      found[{0, root.getStateAttr()}].push_back({root, {}});
  stages = found.takeVector();
  llvm::sort(stages, [](const auto &a, const auto &b) {
    auto name = [](const Stage &stage) {
      return std::pair(stage.first,
                       cast<FlatSymbolRefAttr>(stage.second).getValue());
    };
    return name(a.first) < name(b.first);
  });
}

//===----------------------------------------------------------------------===//
// Asking
//===----------------------------------------------------------------------===//

/// The same value for another pixel. What is read on the way to a place is
/// inside of its buffer: errors are for the pixel's own iteration.
Value RowPrefetcher::clone(Value value, OpBuilder &builder,
                           IRMapping &mapping) {
  if (Value known = mapping.lookupOrNull(value))
    return known;
  if (rows.isDefinedOutsideOfLoop(value))
    return value;
  Operation *op = value.getDefiningOp();
  for (Value operand : op->getOperands())
    mapping.map(operand, clone(operand, builder, mapping));
  Operation *made = builder.clone(*op, mapping);
  auto load = dyn_cast<LoadOp>(made);
  if (load && !load.getChecked() && !load.getIndices().empty()) {
    builder.setInsertionPoint(load);
    CodeBuilder at(builder, load.getLoc());
    Value place = load.getIndices().front(),
          last = at.sub(ExtentOp::create(builder, load.getLoc(),
                                         load.getStateAttr(),
                                         builder.getI64IntegerAttr(0)),
                        at.index(1));
    if (!place.getType().isIndex())
      place = arith::IndexCastOp::create(builder, load.getLoc(),
                                         builder.getIndexType(), place);
    load.getIndicesMutable().assign(
        arith::MinUIOp::create(builder, load.getLoc(), place, last));
    load.setChecked(true);
    builder.setInsertionPointAfter(load);
  }
  return mapping.lookup(value);
}

/// Whether what a stage asks for is too large for the nearest caches: what
/// pixels read at their own place for the second level, and of what that refers
/// to all that leads there for the third. None of it may be empty.
Value RowPrefetcher::isWorthwhile(const Stage &stage, OpBuilder &builder) {
  CodeBuilder at(builder, pixels.getLoc());
  Value worthwhile;
  auto require = [&](Attribute state, int64_t least) {
    auto symbol = cast<FlatSymbolRefAttr>(state);
    auto image = lookupInPipeline<ImageOp>(pixels, symbol);
    Value count;
    for (int64_t d = 0, rank = image ? image.getRank() : 1; d < rank; ++d) {
      Value extent = ExtentOp::create(builder, at.loc, symbol,
                                      builder.getI64IntegerAttr(d));
      count = count ? at.mul(count, extent) : extent;
    }
    Value isLarge = at.compare(CodeBuilder::P::uge, count, at.index(least));
    worthwhile = worthwhile ? at.both(worthwhile, isLarge) : isLarge;
  };
  int64_t bytes = stage.first == 0 ? secondLevelBytes : thirdLevelBytes;
  for (const auto &[other, references] : stages)
    if (other == stage) {
      RecordOp record = lookupRecord(
          pixels, getStateRecord(lookupInPipeline<Operation *>(
                      pixels, cast<FlatSymbolRefAttr>(other.second))));
      require(other.second, bytes / record.getSize());
    }
  for (Attribute state : tested)
    require(state, 1);
  return worthwhile;
}

/// Whether what a pixel reads itself is not what the one of the row before
/// does, as it mostly is where an element shows on many pixels.
Value RowPrefetcher::isNew(OpBuilder &builder, IRMapping &mapping, Value row) {
  CodeBuilder at(builder, pixels.getLoc());
  Value one = arith::ConstantOp::create(
      builder, at.loc, builder.getIntegerAttr(row.getType(), 1));
  IRMapping before;
  before.map(rows.getInductionVar(), at.sub(row, one));
  before.map(pixels.getInductionVar(),
             mapping.lookup(pixels.getInductionVar()));
  Value all;
  for (LoadOp root : roots) {
    if (!root.getType().isIntOrIndex())
      continue;
    Value differs =
        at.compare(CodeBuilder::P::ne, clone(root, builder, mapping),
                   clone(root, builder, before));
    all = all ? at.either(all, differs) : differs;
  }
  return all;
}

void RowPrefetcher::writeStage(const Stage &stage, Value row, bool isFirst,
                               OpBuilder &builder) {
  OpBuilder::InsertionGuard guard(builder);
  CodeBuilder at(builder, pixels.getLoc());
  IRMapping mapping;
  mapping.map(rows.getInductionVar(), row);
  auto loop = scf::ForOp::create(
      builder, at.loc, clone(pixels.getLowerBound(), builder, mapping),
      clone(pixels.getUpperBound(), builder, mapping),
      clone(pixels.getStep(), builder, mapping));
  loop->setAttr(marks::lanes, builder.getUnitAttr());
  builder.setInsertionPointToStart(loop.getBody());
  mapping.map(pixels.getInductionVar(), loop.getInductionVar());
  llvm::MapVector<ArrayRef<Guard>, SmallVector<ValueRange>> places;
  for (const auto &[other, references] : stages)
    if (other == stage)
      for (const RowReference &reference : references)
        places[reference.guards].push_back(reference.getPlace());
  for (auto &[guards, refers] : places) {
    Value all =
        stage.first > 0 && !isFirst ? isNew(builder, mapping, row) : Value();
    for (auto [condition, side] : guards) {
      Value one = clone(condition, builder, mapping);
      if (!side)
        one = arith::XOrIOp::create(builder, at.loc, one, at.boolean(true));
      all = all ? at.both(all, one) : one;
    }
    auto ask = [&] {
      IRMapping inside(mapping);
      for (ValueRange place : refers)
        PrefetchOp::create(builder, at.loc,
                           cast<FlatSymbolRefAttr>(stage.second),
                           llvm::map_to_vector(place, [&](Value index) {
                             return clone(index, builder, inside);
                           }));
    };
    if (all)
      at.when(all, ask);
    else
      ask();
  }
}

void RowPrefetcher::run() {
  findReferences();
  for (Value bound :
       {pixels.getLowerBound(), pixels.getUpperBound(), pixels.getStep()})
    if (std::optional<int64_t> depth = getDepth(bound); !depth || *depth > 0)
      return;
  for (const auto &[stage, references] : stages) {
    OpBuilder builder(rows);
    CodeBuilder at(builder, pixels.getLoc());
    Value worthwhile = isWorthwhile(stage, builder);
    Value lower = rows.getLowerBound(), upper = rows.getUpperBound();
    Value distance = arith::ConstantOp::create(
        builder, at.loc,
        builder.getIntegerAttr(lower.getType(), getDistance(stage)));
    // The first rows, of which a box may have fewer.
    at.when(worthwhile, [&] {
      at.forEach(lower, at.min(upper, at.add(lower, distance)), rows.getStep(),
                 [&](Value row) { writeStage(stage, row, true, builder); });
    });
    // The last ones are known by what is left: there may be no number after.
    builder.setInsertionPoint(pixels);
    Value row = rows.getInductionVar();
    Value isInside =
        at.compare(CodeBuilder::P::sgt, at.sub(upper, row), distance);
    at.when(at.both(worthwhile, isInside),
            [&] { writeStage(stage, at.add(row, distance), false, builder); });
  }
}

void piko::prefetchRows(scf::ForOp rows, scf::ForOp pixels) {
  RowPrefetcher(rows, pixels).run();
}
