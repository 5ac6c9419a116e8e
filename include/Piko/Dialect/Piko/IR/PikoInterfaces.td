// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What operations of the dialect have in common.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOINTERFACES_TD
#define PIKO_DIALECT_PIKO_IR_PIKOINTERFACES_TD

include "mlir/IR/OpBase.td"

// An operation of a phase says what it does: it has no effects, or works on the
// arrays of a call, or has one of these interfaces. The verifier refuses all
// others, so that no pass meets one that it would mistake for harmless.

def Piko_AssignmentInterface : OpInterface<"AssignmentOpInterface"> {
  let cppNamespace = "::piko";
  let description = [{
    Puts the primitive of an assign phase into bins.
  }];
  let methods = [
    InterfaceMethod<"Calls `put` with each bin, ascending, that the primitive "
                    "is put into; `stage` is the `piko.stage`, and `previous` "
                    "the bin that the primitive was emitted from, or null.",
                    "void", "buildBins",
                    (ins "::mlir::OpBuilder &":$builder,
                         "::mlir::Operation *":$stage, "::mlir::Value":$previous,
                         "::piko::PutInBin":$put)>,
    InterfaceMethod<"Whether the primitive is put into the bin it was emitted "
                    "from, and into no other.",
                    "bool", "keepsBin", (ins), [{}], [{ return false; }]>,
    InterfaceMethod<"Whether a bin may be outside of the grid, which ends the "
                    "run with an error.",
                    "bool", "canFail", (ins), [{}], [{ return true; }]>,
  ];
}

def Piko_EmissionInterface : OpInterface<"EmissionOpInterface"> {
  let cppNamespace = "::piko";
  let description = [{
    Sends one primitive out of a port of its stage, each time that it runs, and
    does nothing else: what it emits is all that passes need to know of it, and
    one that changes this puts a `piko.emit` in its place. Its numbers are
    operands of it.
  }];
  let methods = [
    InterfaceMethod<"The port.", "int64_t", "getPort">,
    InterfaceMethod<"The numbers of the port's record: its fields in order, "
                    "arrays row-major.",
                    "::llvm::SmallVector<::mlir::Value>", "getNumbers">,
    InterfaceMethod<"At the machine level the primitive, for placements, or "
                    "null.",
                    "::mlir::Value", "getPrim", (ins), [{}], [{
      return ::mlir::Value();
    }]>,
  ];
  let verify = [{ return ::piko::detail::verifyEmission($_op); }];
}

def Piko_WorkInterface : OpInterface<"WorkOpInterface"> {
  let cppNamespace = "::piko";
  let description = [{
    Work of a stage on what is in a bin, or on what a source is fed.
  }];
  let methods = [
    InterfaceMethod<"The stage.", "::mlir::FlatSymbolRefAttr", "getStageAttr">,
    InterfaceMethod<"The stage that has emitted, in this bin, what it takes; "
                    "null where it takes what the bin holds.",
                    "::mlir::FlatSymbolRefAttr", "getProducerAttr">,
    InterfaceMethod<"The port of that stage, or null.", "::mlir::IntegerAttr",
                    "getPortAttr">,
    InterfaceMethod<"Whether it takes a list.", "bool", "takesList">,
    InterfaceMethod<"What lanes are given, if that is said.",
                    "::std::optional<::piko::LaneMapping>", "getLanes">,
    InterfaceMethod<"Says what lanes are given.", "void", "setLanes",
                    (ins "::std::optional<::piko::LaneMapping>":$lanes)>,
    InterfaceMethod<"What runs for an item or a list.", "::mlir::Block *",
                    "getBodyBlock">,
  ];
}

def Piko_StateAccessInterface : OpInterface<"StateAccessOpInterface"> {
  let cppNamespace = "::piko";
  let description = [{
    Reads or writes a constant, a buffer or an image.
  }];
  let methods = [
    InterfaceMethod<"The state that it uses.", "::mlir::FlatSymbolRefAttr",
                    "getAccessedState">,
    InterfaceMethod<"How it uses it: bits of `StateAccess::Kind`.", "int",
                    "getAccessKinds">,
  ];
}

def Piko_BarrierInterface : OpInterface<"BarrierOpInterface"> {
  let cppNamespace = "::piko";
  let description = [{
    A place at which all iterations of the parallel loop around it meet.
  }];
}

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
