// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What operations of the dialect have in common.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOINTERFACES_TD
#define PIKO_DIALECT_PIKO_IR_PIKOINTERFACES_TD

include "mlir/IR/OpBase.td"

def Piko_ParallelLoopInterface : OpInterface<"ParallelLoopOpInterface"> {
  let cppNamespace = "::piko";
  let description = [{
    A loop whose iterations are independent, have an order, and may meet at
    barriers. The arguments of its block say which iteration it is.
  }];
  let methods = [
    InterfaceMethod<"What an iteration runs.", "::mlir::Block *",
                    "getBodyBlock", (ins), [{}], [{
      return &$_op.getBody().front();
    }]>,
    InterfaceMethod<"The number of an iteration, from 0, as an index that is "
                    "computed where the builder stands, in the body.",
                    "::mlir::Value", "buildIteration",
                    (ins "::mlir::OpBuilder &":$builder)>,
  ];
  let extraSharedClassDeclaration = [{
    /// Whether its iterations meet: a barrier of this loop, not of one inside.
    bool hasBarriers() {
      return ::piko::detail::hasBarriers($_op.getOperation());
    }
  }];
}

#endif // PIKO_DIALECT_PIKO_IR_PIKOINTERFACES_TD
