// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The `piko` dialect: its types, attributes and operations.

#ifndef PIKO_DIALECT_PIKO_IR_PIKO_H
#define PIKO_DIALECT_PIKO_IR_PIKO_H

#include "mlir/Bytecode/BytecodeOpInterface.h"
#include "mlir/Dialect/SCF/IR/SCF.h"
#include "mlir/IR/Builders.h"
#include "mlir/IR/BuiltinOps.h"
#include "mlir/IR/BuiltinTypes.h"
#include "mlir/IR/Dialect.h"
#include "mlir/IR/OpDefinition.h"
#include "mlir/IR/OpImplementation.h"
#include "mlir/IR/SymbolTable.h"
#include "mlir/Interfaces/InferTypeOpInterface.h"
#include "mlir/Interfaces/SideEffectInterfaces.h"

#include "Piko/Dialect/Piko/IR/PikoDialect.h.inc"
#include "Piko/Dialect/Piko/IR/PikoEnums.h.inc"

#define GET_TYPEDEF_CLASSES
#include "Piko/Dialect/Piko/IR/PikoTypes.h.inc"
#define GET_ATTRDEF_CLASSES
#include "Piko/Dialect/Piko/IR/PikoAttributes.h.inc"

namespace piko {
class AssignOp;
class ProcessOp;
class ScheduleOp;

/// What is done for a bin of an assignment.
using PutInBin =
    llvm::function_ref<void(mlir::OpBuilder &builder, mlir::Value bin)>;

namespace StateAccess {
/// Bits, of which a phase may have several.
enum Kind { reads = 1, stores = 2, changesAtomically = 4, updates = 8 };
} // namespace StateAccess

/// Of operations below the machine level, which a target's lowering makes.
template <typename OpT>
class TargetLevel : public mlir::OpTrait::TraitBase<OpT, TargetLevel> {};

/// Of operations that checking mode alone has.
template <typename OpT>
class CheckingMode : public mlir::OpTrait::TraitBase<OpT, CheckingMode> {};

/// Of operations that end the run with an error.
template <typename OpT>
class Failure : public mlir::OpTrait::TraitBase<OpT, Failure> {};

namespace detail {
bool hasBarriers(mlir::Operation *loop);
mlir::LogicalResult verifyEmission(mlir::Operation *emission);
} // namespace detail
} // namespace piko

#include "Piko/Dialect/Piko/IR/PikoInterfaces.h.inc"

#define GET_OP_CLASSES
#include "Piko/Dialect/Piko/IR/PikoOps.h.inc"

namespace piko {

/// The pipeline around an operation, or null.
PipelineOp getPipeline(mlir::Operation *op);

/// The stage whose phase an operation of the authored or kernels level is in,
/// or null.
StageOp getPhaseStage(mlir::Operation *op);

/// The stage that an operation of the machine level, or below, is of: that of
/// the work around it, or whose bins the kernel opens; or null.
StageOp getKernelStage(mlir::Operation *op);

/// The record of that name, seen from `from`, or null.
RecordOp lookupRecord(mlir::Operation *from, mlir::FlatSymbolRefAttr name);

/// The stage or the piece of state of that name in the pipeline around `from`,
/// or null.
template <typename OpT>
OpT lookupInPipeline(mlir::Operation *from, mlir::FlatSymbolRefAttr name) {
  PipelineOp pipeline = getPipeline(from);
  return pipeline ? mlir::dyn_cast_or_null<OpT>(
                        mlir::SymbolTable::lookupSymbolIn(pipeline, name))
                  : OpT();
}

/// The record of a constant, buffer or image, or null.
mlir::FlatSymbolRefAttr getStateRecord(mlir::Operation *state);

/// Checks that a record has the field, that it is `indices` dimensions deep and
/// that its elements are of that type; reports at `op` where not.
mlir::LogicalResult verifyFieldAccess(mlir::Operation *op,
                                      mlir::FlatSymbolRefAttr record,
                                      llvm::StringRef field, size_t indices,
                                      mlir::Type type);

/// How many indices an access to a constant, buffer or image takes.
int64_t getStateRank(mlir::Operation *state);

} // namespace piko

#endif // PIKO_DIALECT_PIKO_IR_PIKO_H
