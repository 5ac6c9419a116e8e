// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What a pipeline takes for granted of what the host gives it.

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

def Piko_ContractOp : Piko_Op<"contract", [
    HasParent<"PipelineOp">, DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "numbers of the host's that are indices";
  let description = [{
    Each number of a field, of a source's primitives or of the elements of a buffer
    that no stage writes, is at least 0 and below the size of another buffer, or
    below a number. The runtime tests them when the host has bound them, or has
    bound that other buffer; a run with others is an error. `unsigned` numbers have
    no sign.

    ```mlir
    piko.record @Triangle {"v" : i32[3 : 4] at 0} size 12 align 4
    piko.record @Index {"value" : i16 at 0} size 2 align 2
    piko.record @Vertex {"z" : f32 at 0} size 4 align 4
    piko.pipeline @P rank 2 {
      piko.buffer @order : @Index
      piko.buffer @vertices : @Vertex
      piko.contract source 0 "v" indexes @vertices
      piko.contract @order "value" unsigned below 16
      piko.source @draw
      piko.stage @draw bins [0, 0] threads 1 : @Triangle -> [] {
        piko.process {
        ^bb0(%t: !piko.prim<@Triangle>):
          piko.return
        }
      }
    }
    ```
  }];
  let arguments = (ins OptionalAttr<FlatSymbolRefAttr>:$buffer,
                       OptionalAttr<I64Attr>:$source, StrAttr:$field,
                       UnitAttr:$hasNoSign,
                       OptionalAttr<FlatSymbolRefAttr>:$target,
                       OptionalAttr<I64Attr>:$below);
  let assemblyFormat = [{
    ($buffer^)? (`source` $source^)? $field (`unsigned` $hasNoSign^)?
    (`indexes` $target^)? (`below` $below^)? attr-dict
  }];
  let extraClassDeclaration = [{
    /// The record that has the field.
    ::mlir::FlatSymbolRefAttr getRecord();
    /// What writes to the buffer; null if nothing does.
    ::mlir::Operation *findWrite();
  }];
}

#endif // PIKO_DIALECT_PIKO_IR_PIKOFIXEDOPS_TD
