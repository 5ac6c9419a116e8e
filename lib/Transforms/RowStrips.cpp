// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "RowStrips.h"

#include "IterationLanes.h"

#include "Piko/Dialect/Piko/IR/Marks.h"

#include "mlir/Dialect/Arith/IR/Arith.h"
#include "mlir/Dialect/MemRef/IR/MemRef.h"

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

/// Writes a loop over strips around the loop over rows.
class StripWriter {
public:
  StripWriter(scf::ForOp rows, scf::ForOp columns)
      : rows(rows), columns(columns), builder(rows), loc(rows.getLoc()) {}
  void write(ArrayRef<HalfPlane> planes, int64_t width);

private:
  /// What is the same for all strips: a plane as one that is not negative
  /// inside, on the first row.
  struct Edge {
    Value first, columnStep;
    Value inverse;   ///< of what it falls by from row to row, f64
    Value bias;      ///< what is added to where it is 0, f64
    Value isFalling; ///< Whether rows from there on are outside.
  };
  Edge prepare(const HalfPlane &plane);
  /// Of a strip, how many rows lie in front of where an edge is 0.
  Value findRow(const Edge &edge, Value firstColumn, Value lastColumn);
  void carryFrom(Value row);

  Value integer(int64_t value) {
    return arith::ConstantIntOp::create(builder, loc, value, 32);
  }
  Value real(double value) {
    return arith::ConstantOp::create(builder, loc,
                                     builder.getF64FloatAttr(value));
  }
  template <class Op> Value make(Value a, Value b) {
    return Op::create(builder, loc, a, b);
  }
  Value toReal(Value number) {
    return arith::SIToFPOp::create(builder, loc, builder.getF64Type(), number);
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
  OpBuilder builder;
  Location loc;
  Value height; ///< f64
};

} // namespace

// Where the edge is 0 is found within 2^-20 of a row, of at most 2^28, by one
// rounded reciprocal and one product. Rows that are nearer than `slack` to it
// count as inside.
StripWriter::Edge StripWriter::prepare(const HalfPlane &plane) {
  constexpr double slack = 1.0 / 1024, far = 1e18;
  Value zero = integer(0), base = plane.base ? plane.base : zero;
  Value rowStep = plane.rowStep ? plane.rowStep : zero;
  Edge edge{make<arith::AddIOp>(
                base, make<arith::MulIOp>(rowStep, rows.getLowerBound())),
            plane.columnStep ? plane.columnStep : zero,
            {},
            {},
            {}};
  using P = arith::CmpIPredicate;
  edge.isFalling = compare(plane.isNegative ? P::sgt : P::slt, rowStep, zero);
  edge.inverse = choose(
      compare(P::eq, rowStep, zero), real(-far),
      make<arith::DivFOp>(real(plane.isNegative ? 1 : -1), toReal(rowStep)));
  if (plane.isNegative) { // -1 - value is not
    edge.first = make<arith::XOrIOp>(edge.first, integer(-1));
    edge.columnStep = make<arith::SubIOp>(zero, edge.columnStep);
  }
  edge.bias = choose(edge.isFalling, real(1 + slack), real(1 - slack));
  return edge;
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
  row = choose(P::OLT, choose(P::OGT, row, real(0)), height);
  return arith::FPToSIOp::create(builder, loc, builder.getI32Type(), row);
}

/// Lets the loop over rows begin with what it had so many rows behind its first
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

void StripWriter::write(ArrayRef<HalfPlane> planes, int64_t width) {
  Value top = rows.getLowerBound(), end = columns.getUpperBound();
  // A box without rows has no strips.
  Value count = make<arith::MaxSIOp>(
      make<arith::SubIOp>(rows.getUpperBound(), top), integer(0));
  height = toReal(count);
  SmallVector<Edge> edges;
  for (const HalfPlane &plane : planes)
    edges.push_back(prepare(plane));
  auto strips = scf::ForOp::create(builder, loc, columns.getLowerBound(), end,
                                   integer(width));
  builder.setInsertionPointToStart(strips.getBody());
  Value left = strips.getInductionVar();
  Value right = make<arith::MinSIOp>(
      arith::AddIOp::create(builder, loc, left, integer(width),
                            arith::IntegerOverflowFlags::nsw),
      end);
  Value last = make<arith::SubIOp>(right, integer(1));
  Value first = integer(0), behind = count;
  for (const Edge &edge : edges) {
    Value row = findRow(edge, left, last);
    first =
        make<arith::MaxSIOp>(first, choose(edge.isFalling, integer(0), row));
    behind = make<arith::MinSIOp>(behind, choose(edge.isFalling, row, count));
  }
  carryFrom(first);
  rows.setLowerBound(make<arith::AddIOp>(top, first));
  rows.setUpperBound(make<arith::AddIOp>(top, behind));
  rows->moveBefore(strips.getBody()->getTerminator());
  columns.setLowerBound(left);
  columns.setUpperBound(right);
}

void piko::interchange(scf::ForOp rows, scf::ForOp columns,
                       ArrayRef<HalfPlane> planes, int64_t width) {
  StripWriter(rows, columns).write(planes, width);
}
