// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Reading and writing a pipeline's state.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOSTATEOPS_TD
#define PIKO_DIALECT_PIKO_IR_PIKOSTATEOPS_TD

include "Piko/Dialect/Piko/IR/PikoAttributes.td"
include "Piko/Dialect/Piko/IR/PikoInterfaces.td"
include "Piko/Dialect/Piko/IR/PikoTypes.td"

class Piko_StateAccessOp<string mnemonic, list<Trait> traits = []>
    : Piko_Op<mnemonic, !listconcat(traits, [
        AttrSizedOperandSegments,
        DeclareOpInterfaceMethods<Piko_StateAccessInterface>,
        DeclareOpInterfaceMethods<SymbolUserOpInterface>])>;

def Piko_LoadOp : Piko_StateAccessOp<"load", [MemoryEffects<[MemRead]>]> {
  let summary = "reads a field of a piece of state";
  let description = [{
    A constant takes no index, a buffer one, an image one for each dimension;
    an element of an array field takes further ones after the field's name.
    An index outside the buffer or image is an error when the pipeline runs;
    `checked` says that the test for it is already there. Where a phase has
    become a part of another stage's, `of` names its stage, for that error, and
    `assign` says that it is an assign phase. At the machine level a pixel may be
    that of a `piko.tile`.

    ```mlir
    %width = piko.load @camera "width" : i32
    %red = piko.load @lights[%i : index] "color.x" : f32
    %cut = piko.load @lights[%i : index] "cutoff"[%j] : f32
    %z = piko.load @depth[%x, %y : i32, i32] "z" : f32
    %c = piko.load of "shade" assign @lights[%i : index] "cutoff"[%j] : f32
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$state,
                       Variadic<Piko_Coordinate>:$indices, StrAttr:$field,
                       Variadic<Index>:$elements,
                       Optional<Piko_TileType>:$tile, UnitAttr:$checked,
                       OptionalAttr<StrAttr>:$of, UnitAttr:$assign);
  let results = (outs Piko_Scalar:$result);
  let assemblyFormat = [{
    (`of` $of^)? (`assign` $assign^)? (`checked` $checked^)? $state
    (`[` $indices^ `:` type($indices) `]`)? $field (`[` $elements^ `]`)?
    (`tile` `(` $tile^ `:` qualified(type($tile)) `)`)?
    attr-dict `:` type($result)
  }];
}

def Piko_StoreOp : Piko_StateAccessOp<"store", [MemoryEffects<[MemWrite]>]> {
  let summary = "writes a field of an element that no other call writes";
  let description = [{
    An index outside the buffer or image is an error when the pipeline runs;
    `checked` says that the test for it is already there, `of` and `tile` are as
    in `piko.load`.

    ```mlir
    piko.store %v, @vertices[%i : index] "position.x" : f32
    piko.store %v, checked @vertices[%i : index] "position.x" : f32
    ```
  }];
  let arguments = (ins Piko_Scalar:$value, FlatSymbolRefAttr:$state,
                       Variadic<Piko_Coordinate>:$indices, StrAttr:$field,
                       Variadic<Index>:$elements,
                       Optional<Piko_TileType>:$tile, UnitAttr:$checked,
                       OptionalAttr<StrAttr>:$of);
  let assemblyFormat = [{
    $value `,` (`of` $of^)? (`checked` $checked^)? $state
    (`[` $indices^ `:` type($indices) `]`)? $field (`[` $elements^ `]`)?
    (`tile` `(` $tile^ `:` qualified(type($tile)) `)`)?
    attr-dict `:` type($value)
  }];
}

def Piko_AtomicOp : Piko_StateAccessOp<"atomic", [
    MemoryEffects<[MemRead, MemWrite]>]> {
  let summary = "changes a number indivisibly";
  let description = [{
    A result is the value that was there. It shows the order of calls, as does
    the rounding of `add_float`: both need a stage that is `unordered`. `of` is
    as in `piko.load`. On the CPU the change may be `in` a private copy, which
    nobody else changes (`piko.cpu.private_copy`).

    ```mlir
    piko.atomic add @histogram[%i : index] "value", %one : i32
    %place = piko.atomic add @next[%i : index] "value", %one : i32 -> i32
    ```
  }];
  let arguments = (ins Piko_AtomicKind:$kind, FlatSymbolRefAttr:$state,
                       Variadic<Piko_Coordinate>:$indices, StrAttr:$field,
                       Variadic<Index>:$elements,
                       AnyTypeOf<[I32, I64, F32, F64]>:$value, UnitAttr:$checked,
                       OptionalAttr<StrAttr>:$of,
                       Optional<Piko_PrivateCopyType>:$copy);
  let results = (outs Optional<AnyTypeOf<[I32, I64, F32, F64]>>:$old);
  let assemblyFormat = [{
    $kind (`of` $of^)? (`checked` $checked^)? $state
    (`[` $indices^ `:` type($indices) `]`)? $field
    (`[` $elements^ `]`)? `,` $value (`in` $copy^)? attr-dict `:` type($value)
    (`->` type($old)^)?
  }];
}

def Piko_PrefetchOp : Piko_Op<"prefetch", [
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "says that an element of state will be read";
  let description = [{
    A hint that changes nothing; an index may be outside.

    ```mlir
    piko.prefetch @vertices[%i : index]
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$state,
                       Variadic<Piko_Coordinate>:$indices);
  let assemblyFormat = [{
    $state `[` $indices `:` type($indices) `]` attr-dict
  }];
}

def Piko_ExtentOp : Piko_Op<"extent", [
    Pure, DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "the length of a buffer, or of an image in a dimension";
  let description = [{
    ```mlir
    %n = piko.extent @lights[0]
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$state,
                       ConfinedAttr<Piko_I64Attr, [IntNonNegative]>:$dim);
  let results = (outs Index:$result);
  let assemblyFormat = "$state `[` $dim `]` attr-dict";
}

def Piko_UpdateOp : Piko_Op<"update", [
    SingleBlock, AttrSizedOperandSegments,
    DeclareOpInterfaceMethods<Piko_StateAccessInterface>,
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "changes a pixel of the primitive's own bin";
  let description = [{
    The body takes the numbers of the pixel, fields in order, and yields the new
    ones; `results` leave it. The calls for one pixel run in lineage order. A
    pixel outside the bin is an error when the pipeline runs. At the machine
    level the operation names the bin that the pixel must be in. `of` and `tile`
    are as in `piko.load`.

    ```mlir
    %passed = piko.update @depth[%x, %y : i32, i32] {
    ^bb0(%old: f32):
      %closer = arith.cmpf olt, %z, %old : f32
      %new = arith.select %closer, %z, %old : f32
      piko.yield [%new : f32] results [%closer : i1]
    } -> i1

    piko.update @depth[%x, %y : i32, i32] in %bin {
    ^bb0(%old: f32):
      piko.yield [%z : f32]
    }
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$image,
                       Variadic<Piko_Coordinate>:$coordinates,
                       Optional<Index>:$bin, Optional<Piko_TileType>:$tile,
                       OptionalAttr<StrAttr>:$of);
  let results = (outs Variadic<AnyType>:$results);
  let regions = (region SizedRegion<1>:$body);
  let assemblyFormat = [{
    (`of` $of^)? $image `[` $coordinates `:` type($coordinates) `]`
    (`in` $bin^)? (`tile` `(` $tile^ `:` qualified(type($tile)) `)`)?
    $body (`->` type($results)^)? attr-dict
  }];
  let hasRegionVerifier = 1;
}

def Piko_YieldOp : Piko_Op<"yield", [
    Pure, Terminator, AttrSizedOperandSegments,
    ParentOneOf<["UpdateOp", "ParallelForOp", "ParallelPixelsOp", "ReduceOp",
                 "ScanOp", "GroupedOp"]>]> {
  let summary = "ends the body of an operation";
  let description = [{
    See `piko.update`, `piko.parallel_for`, `piko.parallel_pixels` and
    `piko.reduce`. Only an update has a pixel to yield.
  }];
  let arguments = (ins Variadic<Piko_Scalar>:$pixel, Variadic<AnyType>:$results);
  let assemblyFormat = [{
    (`[` $pixel^ `:` type($pixel) `]`)?
    (`results` `[` $results^ `:` type($results) `]`)? attr-dict
  }];
}

/// Says that an operation ends the run with an error.
def Piko_Failure : NativeOpTrait<"Failure"> {
  let cppNamespace = "::piko";
}

class Piko_FailureOp<string mnemonic, list<Trait> traits = []>
    : Piko_Op<mnemonic, !listconcat([Piko_Failure], traits)>;

def Piko_FailOp : Piko_FailureOp<"fail", [AttrSizedOperandSegments]> {
  let summary = "ends the run with an error that names the stage";
  let description = [{
    An access of the stage to the piece of state at these indices was outside
    it or, with `bin of`, outside the bin. In a call of Process, `in` says for
    which bin. The error names the stage of `of`, if there is one, whose phase
    is a part of this stage's. The run goes on to the end of the kernel and then
    stops.

    ```mlir
    piko.fail @shade outside @lights(%i)
    piko.fail @shade in %b outside bin of @depth(%i, %j)
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$stage, FlatSymbolRefAttr:$state,
                       Variadic<Index>:$indices, UnitAttr:$outside_bin,
                       Optional<Index>:$bin, OptionalAttr<StrAttr>:$of);
  let assemblyFormat = [{
    $stage (`of` $of^)? (`in` $bin^)? `outside` (`bin` `of` $outside_bin^)? $state
    `(` $indices `)` attr-dict
  }];
}

def Piko_FailListOp : Piko_FailureOp<"fail_list"> {
  let summary = "ends the run: an index was outside a list";
  let description = [{
    See `piko.fail`; the numbers are the index and the size of the list.

    ```mlir
    piko.fail_list @blend in %b at %i of %n
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$stage, Index:$index, Index:$size,
                       Optional<Index>:$bin);
  let assemblyFormat = "$stage (`in` $bin^)? `at` $index `of` $size attr-dict";
}

def Piko_FailBarrierOp : Piko_FailureOp<"fail_barrier"> {
  let summary = "ends the run: an iteration does not meet the others";
  let description = [{
    See `piko.fail`. The iteration is the first one that does not reach the
    same barriers as iteration 0.

    ```mlir
    piko.fail_barrier @blend in %b iteration %i
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$stage, Index:$iteration,
                       Optional<Index>:$bin);
  let assemblyFormat = "$stage (`in` $bin^)? `iteration` $iteration attr-dict";
}

def Piko_FailDivideOp : Piko_FailureOp<"fail_divide"> {
  let summary = "ends the run: an integer division has no result";
  let description = [{
    See `piko.fail`.

    ```mlir
    piko.fail_divide @shade in %b
    piko.fail_divide @shade of "light"
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$stage, Optional<Index>:$bin,
                       OptionalAttr<StrAttr>:$of);
  let assemblyFormat = "$stage (`of` $of^)? (`in` $bin^)? attr-dict";
}

#endif // PIKO_DIALECT_PIKO_IR_PIKOSTATEOPS_TD
