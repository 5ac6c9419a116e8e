// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The counters of a pipeline, and what counts as an operation.

#ifndef PIKO_LIB_TRANSFORMS_COUNTERS_H
#define PIKO_LIB_TRANSFORMS_COUNTERS_H

#include "Piko/Dialect/Piko/IR/PikoCount.h"

#include "llvm/ADT/DenseMap.h"

#include <optional>
#include <tuple>

namespace piko {

class Counters {
public:
  explicit Counters(PipelineOp pipeline) : pipeline(pipeline) {}

  /// The number of a new counter of what lies inside of what another counts.
  int32_t add(mlir::Location loc, CounterKind kind, mlir::StringAttr stage,
              std::optional<int32_t> inside = std::nullopt);
  /// The number of a stage's one counter for a port.
  int32_t getEmissions(mlir::Location loc, mlir::StringAttr stage,
                       int64_t port);
  /// The number of a stage's one counter for such accesses.
  int32_t getAccesses(mlir::Location loc, CounterKind kind,
                      mlir::StringAttr stage, mlir::FlatSymbolRefAttr state);
  /// The number of the one counter for effects in a loop that another counts.
  int32_t getEffects(mlir::Location loc, mlir::StringAttr stage, int32_t loop);
  int32_t size() const { return number; }

private:
  int32_t create(mlir::Location loc, CounterKind kind, mlir::StringAttr stage,
                 mlir::IntegerAttr port, mlir::FlatSymbolRefAttr state,
                 std::optional<int32_t> inside);

  PipelineOp pipeline;
  int32_t number = 0;
  llvm::DenseMap<std::pair<mlir::Attribute, int64_t>, int32_t> ports;
  llvm::DenseMap<int32_t, int32_t> effects; // by loop
  llvm::DenseMap<std::tuple<mlir::Attribute, mlir::Attribute, int32_t>, int32_t>
      accesses;
};

/// The type that an operation computes in, if it is arithmetic: not if it only
/// moves, chooses or converts between integers, or is logic of conditions.
mlir::Type getComputedType(mlir::Operation *op);

} // namespace piko

#endif // PIKO_LIB_TRANSFORMS_COUNTERS_H
