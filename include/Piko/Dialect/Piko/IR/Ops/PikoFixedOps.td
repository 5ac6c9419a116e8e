// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What a pipeline is specialized for.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOFIXEDOPS_TD
#define PIKO_DIALECT_PIKO_IR_PIKOFIXEDOPS_TD

include "Piko/Dialect/Piko/IR/PikoTypes.td"
include "mlir/IR/BuiltinAttributeInterfaces.td"

def Piko_FixedOp : Piko_Op<"fixed", [
    HasParent<"PipelineOp">, DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "a number of the host's that the pipeline was compiled for";
  let description = [{
    A field of a constant, or an element of one that is an array (`"weights"[3]`),
    or without a field how many elements a buffer has. A run with another value is
    an error.

    ```mlir
    piko.fixed @camera "width" = 640 : i32
    piko.fixed @lights = 1 : index
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$state, OptionalAttr<StrAttr>:$field,
                       OptionalAttr<I64Attr>:$element,
                       TypedAttrInterface:$value);
  let assemblyFormat = [{
    $state ($field^ (`[` $element^ `]`)?)? `=` $value attr-dict
  }];
  let extraClassDeclaration = [{
    /// The value's bits, the rest 0.
    uint64_t getBits();
  }];
}

#endif // PIKO_DIALECT_PIKO_IR_PIKOFIXEDOPS_TD
