// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Which primitives stay in the bin that they are emitted from.

#ifndef PIKO_ANALYSIS_BINIDENTITY_H
#define PIKO_ANALYSIS_BINIDENTITY_H

#include "Piko/Analysis/LinearFacts.h"

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
/// - *by range*: the bin is that of a cell, and the cell is between the bounds
///   of the producer's bin wherever a primitive is emitted;
/// - *by function*: the bin is computed from fields as the producer's own bin
///   was computed, and Process hands what goes into it on unchanged.
class BinIdentity : public FactsProvider {
public:
  /// Whether the stage's assignment is the identity; says in `refusal` why not.
  mlir::LogicalResult prove(StageOp consumer, Refusal &refusal);

  bool isFieldInBin(StageOp stage, llvm::StringRef field, int64_t dim) override;

private:
  mlir::LogicalResult proveByRange(EdgeOp edge, AssignToOp to,
                                   Refusal &refusal);
  bool isSameFunction(EdgeOp edge, AssignToOp assignment);

  /// Of stages that keep to the bins before, by field and dimension.
  llvm::DenseMap<std::tuple<mlir::Operation *, mlir::StringAttr, int64_t>, bool>
      fields;
};

} // namespace piko

#endif // PIKO_ANALYSIS_BINIDENTITY_H
