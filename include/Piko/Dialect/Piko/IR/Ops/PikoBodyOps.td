// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What the bodies of phases do with primitives and bins.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOBODYOPS_TD
#define PIKO_DIALECT_PIKO_IR_PIKOBODYOPS_TD

include "Piko/Dialect/Piko/IR/PikoAttributes.td"
include "Piko/Dialect/Piko/IR/PikoInterfaces.td"
include "Piko/Dialect/Piko/IR/PikoTypes.td"

//===----------------------------------------------------------------------===//
// Primitives
//===----------------------------------------------------------------------===//

def Piko_GetOp : Piko_Op<"get", [
    NoMemoryEffect, DeclareOpInterfaceMethods<ConditionallySpeculatable>,
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "reads a field of a primitive";
  let description = [{
    An element of an array field takes an index for each dimension. It runs only
    where it stands unless the indices are constant: a condition around it may
    be what keeps them inside.

    ```mlir
    %z = piko.get %f "z" : !piko.prim<@Fragment> -> f32
    %w = piko.get %f "w"[%i] : !piko.prim<@Fragment> -> f32
    ```
  }];
  let arguments = (ins Piko_PrimType:$prim, StrAttr:$field,
                       Variadic<Index>:$elements);
  let results = (outs Piko_Scalar:$result);
  let assemblyFormat = [{
    $prim $field (`[` $elements^ `]`)? attr-dict
    `:` qualified(type($prim)) `->` type($result)
  }];
  let hasCanonicalizer = 1;
}

def Piko_DivideOp : Piko_Op<"divide", [
    NoMemoryEffect, AllTypesMatch<["lhs", "rhs", "result"]>]> {
  let summary = "an integer division, which may have no result";
  let description = [{
    A division by 0, and a signed one whose quotient is too large, is an error
    when the pipeline runs, and gives 0. A division that nobody needs is none.
    `of` and `assign` are as in `piko.load`. By a constant other than 0 and -1
    it becomes one of `arith`.

    ```mlir
    %q = piko.divide quotient_signed %x, %y : i32
    %r = piko.divide of "shade" remainder_unsigned %mark, %split : i64
    ```
  }];
  let arguments = (ins Piko_DivisionKind:$kind, Piko_Divisible:$lhs,
                       Piko_Divisible:$rhs, OptionalAttr<StrAttr>:$of,
                       UnitAttr:$assign);
  let results = (outs Piko_Divisible:$result);
  let assemblyFormat = [{
    (`of` $of^)? (`assign` $assign^)? $kind $lhs `,` $rhs attr-dict
    `:` type($result)
  }];
  let extraClassDeclaration = [{
    bool isSigned() {
      return getKind() == DivisionKind::QuotientS ||
             getKind() == DivisionKind::RemainderS;
    }
    /// The same operation of arith, for operands with which it has a result.
    ::mlir::Value createUnchecked(::mlir::OpBuilder &builder);
  }];
  let hasCanonicalizeMethod = 1;
}

def Piko_ListSizeOp : Piko_Op<"list_size", [Pure]> {
  let summary = "how many primitives a list has";
  let description = [{
    ```mlir
    %n = piko.list_size %list : !piko.list<@Fragment>
    ```
  }];
  let arguments = (ins Piko_ListType:$list);
  let results = (outs Index:$result);
  let assemblyFormat = "$list attr-dict `:` qualified(type($list))";
}

def Piko_ListAtOp : Piko_Op<"list_at", [MemoryEffects<[MemRead]>]> {
  let summary = "a primitive of a list";
  let description = [{
    An index outside the list is an error when the pipeline runs; `checked` says
    that the test for it is already there.

    ```mlir
    %f = piko.list_at %list[%i] : !piko.list<@Fragment> -> !piko.prim<@Fragment>
    ```
  }];
  let arguments = (ins UnitAttr:$checked, Piko_ListType:$list, Index:$index);
  let results = (outs Piko_PrimType:$prim);
  let assemblyFormat = [{
    (`checked` $checked^)? $list `[` $index `]` attr-dict
    `:` qualified(type($list)) `->` qualified(type($prim))
  }];
  let hasVerifier = 1;
}

def Piko_EmitOp : Piko_Op<"emit", [Piko_EmissionInterface]> {
  let summary = "sends a primitive out of a port";
  let description = [{
    Takes the numbers of the port's record: its fields in order, arrays
    row-major. At the machine level the result is the primitive, for
    `piko.storage.append_bin`.

    ```mlir
    piko.emit 0 (%u, %v) : f32, f32
    ```
  }];
  let arguments = (ins ConfinedAttr<Piko_I64Attr, [IntNonNegative]>:$port,
                       Variadic<Piko_Scalar>:$values);
  let results = (outs Optional<Piko_PrimType>:$prim);
  let assemblyFormat = [{
    $port (`(` $values^ `)` `:` type($values))?
    (`->` qualified(type($prim))^)? attr-dict
  }];
  let extraClassDeclaration = [{
    ::llvm::SmallVector<::mlir::Value> getNumbers() {
      return ::llvm::SmallVector<::mlir::Value>(getValues());
    }
  }];
}

//===----------------------------------------------------------------------===//
// Bins
//===----------------------------------------------------------------------===//

def Piko_BinOp : Piko_Op<"bin", [Pure]> {
  let summary = "the bin that is being processed";
  let description = [{
    Bins are numbered row-major, x fastest.

    ```mlir
    %b = piko.bin
    ```
  }];
  let results = (outs Index:$result);
  let assemblyFormat = "attr-dict";
}

def Piko_BinAtOp : Piko_Op<"bin_at", [Pure]> {
  let summary = "the bin that a cell of the domain is in";
  let description = [{
    The result is a bin of the phase's own stage, or -1 where the cell is
    outside the domain. Coordinates are signed.

    ```mlir
    %b = piko.bin_at %x, %y : i32, i32
    ```
  }];
  let arguments = (ins Variadic<Piko_Coordinate>:$coordinates);
  let results = (outs Index:$result);
  let assemblyFormat = "$coordinates `:` type($coordinates) attr-dict";
  let hasVerifier = 1;
}

class Piko_BinBoundOp<string mnemonic> : Piko_Op<mnemonic, [Pure]> {
  let arguments = (ins Index:$bin, ConfinedAttr<Piko_I64Attr, [IntNonNegative]>:$dim);
  let results = (outs Index:$result);
  let assemblyFormat = "$bin `[` $dim `]` attr-dict";
  let hasVerifier = 1;
}

def Piko_BinLoOp : Piko_BinBoundOp<"bin_lo"> {
  let summary = "the first cell of a bin in a dimension";
  let description = [{
    ```mlir
    %x0 = piko.bin_lo %b[0]
    ```
  }];
}

def Piko_BinHiOp : Piko_BinBoundOp<"bin_hi"> {
  let summary = "the cell after the last of a bin in a dimension";
  let description = [{
    Bins at the edge of the domain are cut there.

    ```mlir
    %x1 = piko.bin_hi %b[0]
    ```
  }];
}

def Piko_DomainOp : Piko_Op<"domain", [Pure]> {
  let summary = "the extent of the domain in a dimension";
  let description = [{
    ```mlir
    %width = piko.domain[0]
    ```
  }];
  let arguments = (ins ConfinedAttr<Piko_I64Attr, [IntNonNegative]>:$dim);
  let results = (outs Index:$result);
  let assemblyFormat = "`[` $dim `]` attr-dict";
  let hasVerifier = 1;
}

def Piko_AllowsUlpsOp : Piko_Op<"allows_ulps", [Pure]> {
  let summary = "whether functions may be so far from the exact result";
  let description = [{
    In units in the last place of a float. A process phase with as many `ulps`, or
    more, allows it; `piko-apply-precision` knows.

    ```mlir
    %cheaper = piko.allows_ulps 4
    ```
  }];
  let arguments = (ins ConfinedAttr<Piko_I64Attr, [IntPositive]>:$ulps);
  let results = (outs I1:$result);
  let assemblyFormat = "$ulps attr-dict";
}

#endif // PIKO_DIALECT_PIKO_IR_PIKOBODYOPS_TD
