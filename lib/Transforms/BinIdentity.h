// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Which primitives stay in the bin that they are emitted from.

#ifndef PIKO_LIB_TRANSFORMS_BINIDENTITY_H
#define PIKO_LIB_TRANSFORMS_BINIDENTITY_H

#include "Piko/Dialect/Piko/IR/Piko.h"

#include "llvm/ADT/DenseSet.h"

namespace piko {

/// Why something is refused, and the operation that is to blame.
struct Refusal {
  mlir::Operation *at = nullptr;
  std::string why;
};

/// The one assignment of an assign phase; null where there are several or none.
mlir::Operation *getOnlyAssignment(AssignOp assign);

/// Proves for stages at the authored level, in order, that what reaches them
/// can only be assigned to the bin that it was emitted from. There are two
/// proofs:
///
/// - *by range*: the bin is that of a cell whose coordinates are fields, and
///   each producer emits coordinates between the bounds of its bin;
/// - *by function*: the bin is computed from fields as the producer's own bin
///   was computed, and Process hands what goes into it on unchanged.
class BinIdentity {
public:
  explicit BinIdentity(PipelineOp pipeline);

  /// Whether a value, at a place of the stage's process phase, lies between the
  /// bounds of the bin that is processed, in one dimension.
  bool isInBin(StageOp stage, int64_t dim, mlir::Operation *at,
               mlir::Value value) const;

  /// Whether the stage's assignment is the identity; says in `refusal` why not.
  mlir::LogicalResult prove(StageOp consumer, Refusal &refusal);

private:
  /// A field of a stage's input and the dimension in which it is a coordinate.
  using Fact = std::tuple<mlir::Operation *, mlir::StringAttr, int64_t>;

  void collectFacts(StageOp stage);
  /// Whether a field of the consumer's primitives is between the bounds of the
  /// bin wherever one is emitted.
  bool isEmittedInBin(StageOp consumer, llvm::StringRef field, int64_t dim,
                      Refusal &refusal);
  bool isSameFunction(EdgeOp edge, AssignToOp assignment);

  PipelineOp pipeline;
  llvm::DenseSet<Fact> facts;

  friend class BinBounds;
};

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_BINIDENTITY_H
