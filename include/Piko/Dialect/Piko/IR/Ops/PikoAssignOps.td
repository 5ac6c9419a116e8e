// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What assign phases say about their primitive.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOASSIGNOPS_TD
#define PIKO_DIALECT_PIKO_IR_PIKOASSIGNOPS_TD

include "Piko/Dialect/Piko/IR/PikoBase.td"
include "Piko/Dialect/Piko/IR/PikoInterfaces.td"

/// What puts the primitive of an assign phase into bins: it must be inside one.
class Piko_AssignmentOp<string mnemonic, list<string> methods = [],
                        list<Trait> traits = []>
    : Piko_Op<mnemonic, !listconcat(traits, [
        DeclareOpInterfaceMethods<Piko_AssignmentInterface, methods>])> {
  let hasVerifier = 1;
}

def Piko_AssignToOp : Piko_AssignmentOp<"assign_to"> {
  let summary = "puts the primitive into a bin";
  let description = [{
    A bin outside the grid, -1 included, is an error when the pipeline runs.

    ```mlir
    piko.assign_to %b
    ```
  }];
  let arguments = (ins Index:$bin);
  let assemblyFormat = "$bin attr-dict";
}

def Piko_AssignAllOp : Piko_AssignmentOp<"assign_all", ["canFail"]> {
  let summary = "puts the primitive into all bins";
  let description = [{
    ```mlir
    piko.assign_all
    ```
  }];
  let assemblyFormat = "attr-dict";
}

def Piko_AssignPreviousOp : Piko_AssignmentOp<"assign_previous", ["keepsBin", "canFail"]> {
  let summary = "puts the primitive into the bin it was emitted from";
  let description = [{
    Both stages have bins of one size, and the stage has no source. `inferred`
    says that it was found by `piko-infer-directives`.

    ```mlir
    piko.assign_previous
    ```
  }];
  let arguments = (ins UnitAttr:$inferred);
  let assemblyFormat = "(`inferred` $inferred^)? attr-dict";
}

def Piko_AssignBoxOp : Piko_AssignmentOp<"assign_box", ["canFail"], [
    AttrSizedOperandSegments]> {
  let summary = "puts the primitive into the bins that a box touches";
  let description = [{
    Takes the closed box of cells, cut at the domain; an empty box is no bin.

    ```mlir
    piko.assign_box [%x0, %y0 : i32, i32] to [%x1, %y1 : i32, i32]
    ```
  }];
  let arguments = (ins Variadic<Piko_Coordinate>:$lo,
                       Variadic<Piko_Coordinate>:$hi);
  let assemblyFormat = [{
    `[` $lo `:` type($lo) `]` `to` `[` $hi `:` type($hi) `]` attr-dict
  }];
}

def Piko_AssignLineOp : Piko_AssignmentOp<"assign_line", ["canFail"], [
    AttrSizedOperandSegments]> {
  let summary = "puts the primitive into the bins that a line touches";
  let description = [{
    Takes the segment from the middle of one cell to that of another, and the bins
    that have a point of it, those at whose edge or corner it only passes as well.
    Cells outside of the domain are in no bin. It is exact; coordinates of more
    than 32 bits are saturated first, as cells of positions are.

    ```mlir
    piko.assign_line [%x0, %y0 : i32, i32] to [%x1, %y1 : i32, i32]
    ```
  }];
  let arguments = (ins Variadic<Piko_Coordinate>:$from,
                       Variadic<Piko_Coordinate>:$to);
  let assemblyFormat = [{
    `[` $from `:` type($from) `]` `to` `[` $to `:` type($to) `]` attr-dict
  }];
}

def Piko_OwnerOp : Piko_Op<"owner"> {
  let summary = "the pixel whose owner processes the primitive";
  let description = [{
    Says in an assign phase that the process phase updates no other pixel. A bin
    that is larger than a tile of its stage's `tile` cells a side may then be
    divided over threads, and each pixel still sees its primitives in order.
    Made by `piko-own-pixels`.

    ```mlir
    piko.owner [%x, %y : i32, i32]
    ```
  }];
  let arguments = (ins Variadic<Piko_Coordinate>:$coordinates);
  let assemblyFormat = "`[` $coordinates `:` type($coordinates) `]` attr-dict";
  let hasVerifier = 1;
}

#endif // PIKO_DIALECT_PIKO_IR_PIKOASSIGNOPS_TD
