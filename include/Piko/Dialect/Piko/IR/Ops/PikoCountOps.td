// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What counting adds to a pipeline: counters, and what is added to them.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOCOUNTOPS_TD
#define PIKO_DIALECT_PIKO_IR_PIKOCOUNTOPS_TD

include "Piko/Dialect/Piko/IR/PikoTypes.td"

// The numbers are those of pikort_counter_kind.
def Piko_CounterKind : I32EnumAttr<"CounterKind", "what a counter counts", [
  I32EnumAttrCase<"Calls", 0, "calls">,
  I32EnumAttrCase<"Iterations", 1, "iterations">,
  I32EnumAttrCase<"Trips", 2, "trips">,
  I32EnumAttrCase<"Emissions", 3, "emissions">,
  I32EnumAttrCase<"Reads", 4, "reads">,
  I32EnumAttrCase<"Stores", 5, "stores">,
  I32EnumAttrCase<"Updates", 6, "updates">,
  I32EnumAttrCase<"Atomics", 7, "atomics">,
  I32EnumAttrCase<"Floats", 8, "floats">,
  I32EnumAttrCase<"Integers", 9, "integers">,
  I32EnumAttrCase<"Effects", 10, "effects">,
  I32EnumAttrCase<"Scalars", 11, "scalars">,
  I32EnumAttrCase<"Vectors", 12, "vectors">,
  I32EnumAttrCase<"Lanes", 13, "lanes">,
  I32EnumAttrCase<"ActiveLanes", 14, "active_lanes">]> {
  let cppNamespace = "::piko";
}

def Piko_CounterOp : Piko_Op<"counter", [
    HasParent<"PipelineOp">, DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "a number that the runtime adds up";
  let description = [{
    Of a stage, which may have become a part of another one; emissions are those
    of a port, and accesses those to a piece of state. What is counted may lie `inside` of what an earlier counter counts, a loop
    or the calls; effects are the emissions, updates and atomics whose innermost
    loop that is. The location is the place in the text that a
    report names.

    ```mlir
    piko.counter 0 calls of "shade"
    piko.counter 1 trips of "shade" inside 0
    piko.counter 2 effects of "shade" inside 1
    piko.counter 3 emissions of "shade" port 0
    piko.counter 4 reads of "shade" to @lights
    ```
  }];
  let arguments = (ins I32Attr:$number, Piko_CounterKind:$kind,
                       StrAttr:$stage, OptionalAttr<I64Attr>:$port,
                       OptionalAttr<FlatSymbolRefAttr>:$state,
                       OptionalAttr<I32Attr>:$inside);
  let assemblyFormat = [{
    $number $kind `of` $stage (`port` $port^)? (`to` $state^)?
    (`inside` $inside^)? attr-dict
  }];
}

def Piko_CountOp : Piko_Op<"count"> {
  let summary = "adds to a counter";
  let description = [{
    ```mlir
    piko.count 0 by %n
    ```
  }];
  let arguments = (ins I32Attr:$number, Index:$amount);
  let assemblyFormat = "$number `by` $amount attr-dict";
}

def Piko_CountElementOp : Piko_Op<"count_element", [
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "adds an access to a counter";
  let description = [{
    To so many bytes of an element, which begin at an offset in it.

    ```mlir
    piko.count_element 2 @lights[%i : index] 4 bytes at 16
    ```
  }];
  let arguments = (ins I32Attr:$number, FlatSymbolRefAttr:$state,
                       Variadic<Piko_Coordinate>:$indices, I64Attr:$bytes,
                       I64Attr:$offset);
  let assemblyFormat = [{
    $number $state `[` $indices `:` type($indices) `]` $bytes `bytes` `at`
    $offset attr-dict
  }];
}

#endif // PIKO_DIALECT_PIKO_IR_PIKOCOUNTOPS_TD
