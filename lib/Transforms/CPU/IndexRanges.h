// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Interval arithmetic when the program runs: the least and the greatest number
// that an index takes in a nest of loops, computed before it.

#ifndef PIKO_LIB_TRANSFORMS_INDEXRANGES_H
#define PIKO_LIB_TRANSFORMS_INDEXRANGES_H

#include "Piko/Analysis/CountedLoop.h"
#include "Piko/Dialect/Piko/IR/Piko.h"

#include "llvm/ADT/DenseMap.h"

namespace piko {

/// How a loop counts by one: with which of its values, from where, and while it
/// is less than what.
struct LoopCount {
  mlir::Value value, first, end;
};
std::optional<LoopCount> findLoopCount(mlir::LoopLikeOpInterface loop);

/// Writes ranges, and what they rest on, where the builder stands. Numbers are
/// of type index, and below 2^31 in magnitude where the test holds, so that
/// nothing wraps around.
class IndexRanges {
public:
  IndexRanges(mlir::LoopLikeOpInterface root, mlir::OpBuilder &builder);

  struct Range {
    mlir::Value least, greatest;
  };
  /// None if an index depends on what is not known before the loops.
  std::optional<Range> get(mlir::Value value);
  /// Whether a value has a range; then a division has a result, too.
  bool isKnown(mlir::Value value) const {
    return known.lookup(value).has_value();
  }
  /// That all elements from one to another are in an extent of state.
  void expectInside(Range range, mlir::FlatSymbolRefAttr state, int64_t dim);
  /// That all holds.
  mlir::Value getTest() const { return test; }

private:
  std::optional<Range> find(mlir::Value value);
  std::optional<Range> findOfOperation(mlir::Operation *op);
  std::optional<Range> findByConstant(mlir::Operation *op, int64_t number);
  std::optional<Range> findOfDivision(DivideOp division);
  std::optional<Range> findOfRemainder(mlir::Value lhs, mlir::Value rhs,
                                       bool isSigned);
  Range getLeaf(mlir::Value value);
  Range multiply(Range a, Range b);
  Range getUnion(Range a, Range b);
  template <class Op> mlir::Value create(mlir::Value a, mlir::Value b) {
    return builder.createOrFold<Op>(loc, a, b);
  }
  mlir::Value constant(int64_t value);
  void expect(mlir::arith::CmpIPredicate predicate, mlir::Value a,
              mlir::Value b);

  mlir::LoopLikeOpInterface root;
  mlir::OpBuilder &builder;
  mlir::Location loc;
  mlir::Value test;
  llvm::DenseMap<mlir::Value, LoopCount> counts;
  llvm::DenseMap<mlir::Value, std::optional<Range>> known;
};

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_INDEXRANGES_H
