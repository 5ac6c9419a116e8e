// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Work that a bin's threads share, and where its iterations meet.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOLOOPOPS_TD
#define PIKO_DIALECT_PIKO_IR_PIKOLOOPOPS_TD

include "Piko/Dialect/Piko/IR/PikoBase.td"
include "Piko/Dialect/Piko/IR/PikoInterfaces.td"

/// Independent iterations, which the threads of a bin share.
class Piko_ParallelLoopOp<string mnemonic, list<Trait> traits = []>
    : Piko_Op<mnemonic, !listconcat(traits, [
        SingleBlock, AutomaticAllocationScope,
        DeclareOpInterfaceMethods<Piko_ParallelLoopInterface>])> {
  let regions = (region SizedRegion<1>:$body);
  let hasRegionVerifier = 1;
}

def Piko_ParallelForOp : Piko_ParallelLoopOp<"parallel_for"> {
  let summary = "independent iterations, spread over the threads of a bin";
  let description = [{
    Runs the body for each index from 0 up to the operand, exclusive, and ends
    when all iterations have ended; a count below 1 is none. Emissions are
    ordered by iteration, then as they come. A private array that stands in the
    body belongs to one iteration, one that stands outside to all of them.

    ```mlir
    piko.parallel_for %n {
    ^bb0(%i: index):
      %f = piko.list_at %list[%i] : !piko.list<@Fragment> -> !piko.prim<@Fragment>
      piko.yield
    }
    ```
  }];
  let arguments = (ins Index:$count);
  let assemblyFormat = "$count attr-dict-with-keyword $body";
  let extraClassDeclaration = [{
    ::mlir::Value getIteration() { return getBody().getArgument(0); }
  }];
}

def Piko_ParallelPixelsOp : Piko_ParallelLoopOp<"parallel_pixels", [
    SameVariadicOperandSize]> {
  let summary = "independent iterations over the pixels of a box";
  let description = [{
    Is `piko.parallel_for` over the cells from `lo` up to `hi`, exclusive, x
    fastest: their coordinates are the arguments of the body, as many as the
    pipeline has dimensions. A box without cells is no iteration. The box may be
    any; that its pixels lie in the bin is what its bounds say, as those of
    `parallelForPixels` do, which are clipped to the bin.

    ```mlir
    piko.parallel_pixels (%x0, %y0) to (%x1, %y1) {
    ^bb0(%x: i32, %y: i32):
      %old = piko.load @depth[%x, %y : i32, i32] "z" : f32
      piko.yield
    }
    ```

    It stays until loops are split, so that a pass finds pixels, and not numbers
    that it would have to take apart.
  }];
  let arguments = (ins Variadic<I32>:$lo, Variadic<I32>:$hi);
  let assemblyFormat = [{
    `(` $lo `)` `to` `(` $hi `)` attr-dict-with-keyword $body
  }];
  let extraClassDeclaration = [{
    ::mlir::Block::BlockArgListType getCell() {
      return getBody().getArguments();
    }
  }];
}

/// An operation at which all iterations of the enclosing parallel loop meet.
/// That loop is not nested, and the control flow from it to the operation is the
/// same in all its iterations.
class Piko_BarrierOp<string mnemonic, list<Trait> traits = []>
    : Piko_Op<mnemonic, !listconcat(traits, [
        DeclareOpInterfaceMethods<Piko_BarrierInterface>])> {
  let hasVerifier = 1;
}

def Piko_SyncOp : Piko_BarrierOp<"sync"> {
  let summary = "a barrier between the iterations";
  let description = [{
    Directly inside a `piko.parallel_for` or `piko.parallel_pixels` that is not
    nested, in control flow that is uniform over its iterations.

    ```mlir
    piko.sync
    ```
  }];
  let assemblyFormat = "attr-dict";
}

def Piko_ReduceOp : Piko_BarrierOp<"reduce", [
    SingleBlock, AllTypesMatch<["values", "results"]>]> {
  let summary = "combines a value of each iteration";
  let description = [{
    A barrier, legal where `piko.sync` is. The body combines two values, each of
    which may be several numbers: first all of the left one, then all of the
    right one. The values are combined in a binary tree over the index: at
    distance s = 1, 2, 4, ... the value at i, for each multiple i of 2s with
    i + s < n, becomes op(v[i], v[i + s]). Every iteration gets v[0].

    ```mlir
    %sum = piko.reduce %v : f32 {
    ^bb0(%a: f32, %b: f32):
      %c = arith.addf %a, %b : f32
      piko.yield results [%c : f32]
    }
    ```
  }];
  let arguments = (ins Variadic<Piko_Scalar>:$values);
  let results = (outs Variadic<Piko_Scalar>:$results);
  let regions = (region SizedRegion<1>:$body);
  let assemblyFormat = "$values `:` type($values) attr-dict-with-keyword $body";
  let hasRegionVerifier = 1;
}

def Piko_ScanOp : Piko_BarrierOp<"scan", [
    SingleBlock, SameVariadicOperandSize,
    AllTypesMatch<["values", "empty", "results"]>]> {
  let summary = "combines the values of the iterations before each";
  let description = [{
    A barrier, legal where `piko.sync` is. Iteration 0 gets `empty`; iteration i
    gets the largest aligned blocks of 2^k values before it, each combined as by
    `piko.reduce`, joined from the left.

    ```mlir
    %before = piko.scan %count empty %zero : i32 {
    ^bb0(%a: i32, %b: i32):
      %c = arith.addi %a, %b : i32
      piko.yield results [%c : i32]
    }
    ```
  }];
  let arguments = (ins Variadic<Piko_Scalar>:$values,
                       Variadic<Piko_Scalar>:$empty);
  let results = (outs Variadic<Piko_Scalar>:$results);
  let regions = (region SizedRegion<1>:$body);
  let assemblyFormat = [{
    $values `empty` $empty `:` type($values) attr-dict-with-keyword $body
  }];
  let hasRegionVerifier = 1;
}

def Piko_SortOp : Piko_BarrierOp<"sort"> {
  let summary = "ranks the iterations by a key";
  let description = [{
    A barrier, legal where `piko.sync` is. Iteration r gets the index of the
    iteration with the r-th smallest key; equal keys are in order of index, and
    NaN comes last. Integers are signed unless `unsigned` is said.

    ```mlir
    %index = piko.sort %depth : f32
    %other = piko.sort unsigned %id : i32
    ```
  }];
  let arguments = (ins UnitAttr:$isUnsigned, Piko_Scalar:$key);
  let results = (outs Index:$index);
  let assemblyFormat = "(`unsigned` $isUnsigned^)? $key attr-dict `:` type($key)";
}

def Piko_GroupedOp : Piko_BarrierOp<"grouped", [
    SingleBlock, AttrSizedOperandSegments]> {
  let summary = "runs what iterations of equal keys do one after the other";
  let description = [{
    A barrier, legal where `piko.sync` is. Runs the body once for each iteration
    whose condition holds: iterations of equal keys in order of index, others in
    any order, so that threads share groups. The body gets the coordinates of the
    key, and then the iteration's values. An iteration whose condition does not
    hold gets zeros for results.

    ```mlir
    piko.grouped where %always by %x, %y : i32, i32 with %z : f32 {
    ^bb0(%column: i32, %row: i32, %factor: f32):
      piko.update @depth[%column, %row : i32, i32] in %bin {
      ^bb0(%old: f32):
        %new = arith.mulf %old, %factor : f32
        piko.yield [%new : f32]
      }
      piko.yield
    }
    ```

    `piko-map-threads` makes it of updates whose pixels follow from data.
  }];
  let arguments = (ins I1:$condition, Variadic<Piko_Coordinate>:$key,
                       Variadic<AnyType>:$values);
  let results = (outs Variadic<Piko_Scalar>:$results);
  let regions = (region SizedRegion<1>:$body);
  let assemblyFormat = [{
    `where` $condition `by` $key `:` type($key)
    (`with` $values^ `:` type($values))? attr-dict-with-keyword $body
    (`->` type($results)^)?
  }];
  let hasRegionVerifier = 1;
}

#endif // PIKO_DIALECT_PIKO_IR_PIKOLOOPOPS_TD
