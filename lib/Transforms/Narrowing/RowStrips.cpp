// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Around the loop over the rows of a strip stands what finds which of them the
// half-planes of all edges reach. So hardly any vector is empty, and what a
// branch decides changes once a strip, not once a row. For half as many strips
// as there are lanes this is found at once, in vectors, unless lanes may be
// primitives.

#include "Narrowing/RowStrips.h"

#include "Vectorize/Analysis/IterationLanes.h"

#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"
#include "mlir/Dialect/Vector/IR/VectorOps.h"

#include <limits>

using namespace mlir;
using namespace piko;

//===----------------------------------------------------------------------===//
// Legality
//===----------------------------------------------------------------------===//

static Value stripCast(Value index) {
  auto cast = index.getDefiningOp<arith::IndexCastOp>();
  return cast ? cast.getIn() : index;
}

namespace {

/// What the pixels of a loop access.
class PixelAccesses {
public:
  PixelAccesses(scf::ForOp rows, scf::ForOp columns)
      : rows(rows), columns(columns) {
    columns.walk([&](StoreOp store) { written.insert(store.getStateAttr()); });
  }
  bool areOwn();

private:
  bool isOfPixel(Attribute state, ValueRange indices);
  bool isOwnArray(Value array) const {
    return columns->isAncestor(array.getParentBlock()->getParentOp());
  }
  bool isOwn(Operation *op);

  scf::ForOp rows, columns;
  llvm::DenseSet<Attribute> written;
  llvm::DenseMap<Attribute, SmallVector<Value>> pixels; ///< by state
};

} // namespace

/// Whether indices are the pixel's row and column, in the order in which all
/// accesses have them.
bool PixelAccesses::isOfPixel(Attribute state, ValueRange indices) {
  auto at = llvm::map_to_vector(indices, stripCast);
  return llvm::is_contained(at, rows.getInductionVar()) &&
         llvm::is_contained(at, columns.getInductionVar()) &&
         pixels.try_emplace(state, at).first->second == at;
}

bool PixelAccesses::isOwn(Operation *op) {
  if (auto load = dyn_cast<LoadOp>(op))
    return !written.contains(load.getStateAttr()) ||
           isOfPixel(load.getStateAttr(), load.getIndices());
  if (auto store = dyn_cast<StoreOp>(op))
    return isOfPixel(store.getStateAttr(), store.getIndices());
  if (auto load = dyn_cast<memref::LoadOp>(op))
    return isOwnArray(load.getMemRef());
  if (auto store = dyn_cast<memref::StoreOp>(op))
    return isOwnArray(store.getMemRef());
  return isStructure(op) || isMemoryEffectFree(op) || isPrefetch(op) ||
         isa<memref::AllocaOp>(op);
}

bool PixelAccesses::areOwn() {
  return !columns.getBody()
              ->walk([&](Operation *op) {
                return isOwn(op) ? WalkResult::advance()
                                 : WalkResult::interrupt();
              })
              .wasInterrupted();
}

/// What a carried number grows by in each row, or null.
static Value getRowStep(scf::ForOp rows, BlockArgument carried) {
  auto add = rows.getTiedLoopYieldedValue(carried)
                 ->get()
                 .getDefiningOp<arith::AddIOp>();
  if (!add || add.getLhs() != carried ||
      !rows.isDefinedOutsideOfLoop(add.getRhs()))
    return {};
  return add.getRhs();
}

bool piko::canInterchange(scf::ForOp rows, scf::ForOp columns) {
  Type type = columns.getLowerBound().getType();
  bool isKnown = type.isInteger(32) && rows.getLowerBound().getType() == type &&
                 rows->hasAttr(marks::rows) && rows->use_empty() &&
                 columns->getParentOp() == rows && columns.getNumResults() == 0;
  if (!isKnown || !llvm::all_of(rows.getRegionIterArgs(), [&](auto carried) {
        return getRowStep(rows, carried);
      }))
    return false;
  for (Operation &op : rows.getBody()->without_terminator())
    if (&op != columns && !isPure(&op))
      return false;
  return PixelAccesses(rows, columns).areOwn();
}

//===----------------------------------------------------------------------===//
// Writing
//===----------------------------------------------------------------------===//

namespace {

/// Writes a loop over strips around the loop over rows. What rows strips have
/// is found for `group` of them at once, in vectors if it is more than one.
class StripWriter {
public:
  StripWriter(scf::ForOp rows, scf::ForOp columns, int64_t width, int64_t group)
      : rows(rows), columns(columns), width(width), group(group), builder(rows),
        loc(rows.getLoc()) {}
  void write(ArrayRef<HalfPlane> planes);

private:
  /// What is the same for all strips: a plane as one that is not negative
  /// inside, on the first row.
  struct Edge {
    Value first, columnStep;
    Value inverse; ///< of what it falls by from row to row, f64
    Value bias;    ///< what is added to where it is 0, f64
    /// Bits that leave a row as it is, or make it the least or the greatest
    /// number, where rows from there on are outside, or up to there.
    Value firstBits, endBits;
  };
  /// Of the strips of a group, numbers of rows: the first one, and how many
  /// there are up to the last one.
  struct Bounds {
    Value first, end;
  };
  Edge prepare(const HalfPlane &plane);
  Bounds findBounds(ArrayRef<Edge> edges, Value left);
  /// Of strips, how many rows lie before where an edge is 0.
  Value findRow(const Edge &edge, Value firstColumn, Value lastColumn);
  Value enterLoop(Value left, Value end, int64_t step);
  void moveRows(Value column, Bounds bounds);
  void carryFrom(Value row);

  Value integer(int64_t value) {
    return arith::ConstantIntOp::create(builder, loc, value, 32);
  }
  Value real(double value) {
    return arith::ConstantOp::create(builder, loc,
                                     builder.getF64FloatAttr(value));
  }
  /// A number for each strip of a group.
  Value spread(Value number) {
    if (group == 1)
      return number;
    auto type = VectorType::get({group}, number.getType());
    return vector::BroadcastOp::create(builder, loc, type, number);
  }
  template <class Op> Value make(Value a, Value b) {
    return Op::create(builder, loc, a, b);
  }
  template <class Op> Value convert(Value number, Type to) {
    if (auto type = dyn_cast<VectorType>(number.getType()))
      to = type.clone(to);
    return Op::create(builder, loc, to, number);
  }
  Value toReal(Value number) {
    return convert<arith::SIToFPOp>(number, builder.getF64Type());
  }
  Value choose(Value condition, Value yes, Value no) {
    return arith::SelectOp::create(builder, loc, condition, yes, no);
  }
  Value compare(arith::CmpIPredicate predicate, Value a, Value b) {
    return arith::CmpIOp::create(builder, loc, predicate, a, b);
  }
  /// The lesser or the greater of two, neither of which is NaN.
  Value choose(arith::CmpFPredicate predicate, Value a, Value b) {
    return choose(arith::CmpFOp::create(builder, loc, predicate, a, b), a, b);
  }

  scf::ForOp rows, columns;
  int64_t width, group;
  OpBuilder builder;
  Location loc;
  Value count, height; ///< Of rows, also as f64 of each strip.
};

} // namespace

// Where the edge is 0 is found within 2^-20 of a row, of at most 2^28, by one
// rounded reciprocal and one product. Rows that are nearer than `slack` to it
// count as inside.
StripWriter::Edge StripWriter::prepare(const HalfPlane &plane) {
  constexpr double slack = 1.0 / 1024, far = 1e18;
  constexpr int32_t most = std::numeric_limits<int32_t>::max();
  Value zero = integer(0), base = plane.base ? plane.base : zero;
  Value rowStep = plane.rowStep ? plane.rowStep : zero;
  Value columnStep = plane.columnStep ? plane.columnStep : zero;
  Value first = make<arith::AddIOp>(
      base, make<arith::MulIOp>(rowStep, rows.getLowerBound()));
  using P = arith::CmpIPredicate;
  Value isFalling = compare(plane.isNegative ? P::sgt : P::slt, rowStep, zero);
  Value inverse = choose(
      compare(P::eq, rowStep, zero), real(-far),
      make<arith::DivFOp>(real(plane.isNegative ? 1 : -1), toReal(rowStep)));
  if (plane.isNegative) { // -1 - value is not
    first = make<arith::XOrIOp>(first, integer(-1));
    columnStep = make<arith::SubIOp>(zero, columnStep);
  }
  Value bias = choose(isFalling, real(1 + slack), real(1 - slack));
  return {spread(first),
          spread(columnStep),
          spread(inverse),
          spread(bias),
          spread(choose(isFalling, zero, integer(-1))),
          spread(choose(isFalling, zero, integer(most)))};
}

// A half-plane reaches as far in a strip as at one of its outer columns.
Value StripWriter::findRow(const Edge &edge, Value firstColumn,
                           Value lastColumn) {
  auto at = [&](Value column) {
    return make<arith::AddIOp>(edge.first,
                               make<arith::MulIOp>(edge.columnStep, column));
  };
  Value most = make<arith::MaxSIOp>(at(firstColumn), at(lastColumn));
  Value row = make<arith::AddFOp>(
      make<arith::MulFOp>(toReal(most), edge.inverse), edge.bias);
  using P = arith::CmpFPredicate;
  row = choose(P::OLT, choose(P::OGT, row, spread(real(0))), height);
  return convert<arith::FPToSIOp>(row, builder.getI32Type());
}

// Strips after the last column have bounds, too, but nobody reads them.
StripWriter::Bounds StripWriter::findBounds(ArrayRef<Edge> edges, Value left) {
  Value lefts = spread(left);
  if (group > 1) {
    SmallVector<int32_t> places;
    for (int64_t strip = 0; strip < group; ++strip)
      places.push_back(strip * width);
    lefts = make<arith::AddIOp>(
        lefts, arith::ConstantOp::create(builder, loc,
                                         builder.getI32VectorAttr(places)));
  }
  Value last = make<arith::MinSIOp>(
      make<arith::AddIOp>(lefts, spread(integer(width - 1))),
      spread(make<arith::SubIOp>(columns.getUpperBound(), integer(1))));
  Bounds bounds{spread(integer(0)), spread(count)};
  for (const Edge &edge : edges) {
    Value row = findRow(edge, lefts, last);
    bounds.first = make<arith::MaxSIOp>(
        bounds.first, make<arith::AndIOp>(row, edge.firstBits));
    bounds.end =
        make<arith::MinSIOp>(bounds.end, make<arith::OrIOp>(row, edge.endBits));
  }
  return bounds;
}

/// Lets the loop over rows begin with what it had so many rows after its first
/// one.
void StripWriter::carryFrom(Value row) {
  for (BlockArgument carried : rows.getRegionIterArgs()) {
    Value step = getRowStep(rows, carried), by = row;
    if (step.getType().isIndex())
      by = arith::IndexCastOp::create(builder, loc, step.getType(), by);
    else if (step.getType() != by.getType())
      by = arith::ExtSIOp::create(builder, loc, step.getType(), by);
    OpOperand *init = rows.getTiedLoopInit(carried);
    init->set(make<arith::AddIOp>(init->get(), make<arith::MulIOp>(step, by)));
  }
}

/// Moves the loop over rows, of a strip that begins with a column, in here.
void StripWriter::moveRows(Value column, Bounds bounds) {
  Value right = make<arith::MinSIOp>(
      arith::AddIOp::create(builder, loc, column, integer(width),
                            arith::IntegerOverflowFlags::nsw),
      columns.getUpperBound());
  carryFrom(bounds.first);
  Value top = rows.getLowerBound();
  rows.setLowerBound(make<arith::AddIOp>(top, bounds.first));
  rows.setUpperBound(make<arith::AddIOp>(top, bounds.end));
  rows->moveBefore(builder.getInsertionBlock()->getTerminator());
  columns.setLowerBound(column);
  columns.setUpperBound(right);
}

/// Enters a loop over what is between two columns, in steps; its variable.
Value StripWriter::enterLoop(Value left, Value end, int64_t step) {
  auto made = scf::ForOp::create(builder, loc, left, end, integer(step));
  builder.setInsertionPointToStart(made.getBody());
  return made.getInductionVar();
}

void StripWriter::write(ArrayRef<HalfPlane> planes) {
  Value left = columns.getLowerBound(), end = columns.getUpperBound();
  // A box without rows has no strips.
  count = make<arith::MaxSIOp>(
      make<arith::SubIOp>(rows.getUpperBound(), rows.getLowerBound()),
      integer(0));
  height = spread(toReal(count));
  SmallVector<Edge> edges;
  for (const HalfPlane &plane : planes)
    edges.push_back(prepare(plane));
  if (group == 1) {
    left = enterLoop(left, end, width);
    moveRows(left, findBounds(edges, left));
    return;
  }
  left = enterLoop(left, end, group * width);
  Bounds bounds = findBounds(edges, left);
  end = make<arith::MinSIOp>(make<arith::AddIOp>(left, integer(group * width)),
                             end);
  Value column = enterLoop(left, end, width);
  Value strip = convert<arith::IndexCastUIOp>(
      make<arith::DivUIOp>(make<arith::SubIOp>(column, left), integer(width)),
      builder.getIndexType());
  for (Value *bound : {&bounds.first, &bounds.end})
    *bound = vector::ExtractOp::create(builder, loc, *bound, strip);
  moveRows(column, bounds);
}

void piko::interchange(scf::ForOp rows, scf::ForOp columns,
                       ArrayRef<HalfPlane> planes, int64_t width,
                       int64_t group) {
  StripWriter(rows, columns, width, group).write(planes);
}
