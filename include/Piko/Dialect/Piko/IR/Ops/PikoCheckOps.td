// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What checking mode adds to a pipeline. Each operation tells the runtime what
// happens next; its location is the place that a finding names.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOCHECKOPS_TD
#define PIKO_DIALECT_PIKO_IR_PIKOCHECKOPS_TD

include "Piko/Dialect/Piko/IR/PikoTypes.td"

/// Says that checking mode alone has the operation: how the reference reports,
/// in order, is what matters there.
def Piko_CheckingMode : NativeOpTrait<"CheckingMode"> {
  let cppNamespace = "::piko";
}

class Piko_CheckOp<string mnemonic, list<Trait> traits = []>
    : Piko_Op<"check_" # mnemonic, !listconcat([Piko_CheckingMode], traits)>;

def Piko_CheckedAccess : I32EnumAttr<"CheckedAccess", "access to state", [
  I32EnumAttrCase<"Read", 0, "read">,
  I32EnumAttrCase<"Store", 1, "store">,
  I32EnumAttrCase<"Update", 2, "update">,
  I32EnumAttrCase<"Atomic", 3, "atomic">]> {
  let cppNamespace = "::piko";
}

def Piko_CheckedLoop : I32EnumAttr<"CheckedLoop", "event of a parallel loop", [
  I32EnumAttrCase<"Begin", 0, "begin">,
  I32EnumAttrCase<"Iteration", 1, "iteration">,
  I32EnumAttrCase<"Barrier", 2, "barrier">,
  I32EnumAttrCase<"End", 3, "end">]> {
  let cppNamespace = "::piko";
}

def Piko_CheckedValue : I32EnumAttr<"CheckedValue", "defect of a value", [
  I32EnumAttrCase<"NaN", 0, "nan">,
  I32EnumAttrCase<"Unwritten", 1, "unwritten">]> {
  let cppNamespace = "::piko";
}

def Piko_UndefinedOp : Piko_Op<"undefined", [Pure]> {
  let summary = "a number that nobody has written";
  let description = [{
    What a local variable holds before it is written. The front end says so in
    checking mode only; otherwise such a number is 0. `piko-add-checks` replaces
    it by 0.

    ```mlir
    %x = piko.undefined : f32
    ```
  }];
  let results = (outs Piko_Scalar:$result);
  let assemblyFormat = "attr-dict `:` type($result)";
}

def Piko_CheckRecordOp : Piko_CheckOp<"record", [
    HasParent<"PipelineOp">, DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "a record with room for a lineage";
  let description = [{
    The first record is the second one, which the host knows, with one more
    field, `piko.lineage`, after it. Of the fields in `numbers`, or of the
    numbers that their names begin, none may be NaN.

    ```mlir
    piko.check_record @Fragment.checked of @Fragment numbers ["z"]
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$record, FlatSymbolRefAttr:$host,
                       OptionalAttr<StrArrayAttr>:$numbers);
  let assemblyFormat = "$record `of` $host (`numbers` $numbers^)? attr-dict";
}

def Piko_CheckCallOp : Piko_CheckOp<"call"> {
  let summary = "a call of a process phase begins";
  let description = [{
    In the bin, for a primitive with that lineage; a list has none.

    ```mlir
    piko.check_call @shade in %bin of %lineage
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$stage, Index:$bin,
                       Optional<I64>:$lineage);
  let assemblyFormat = "$stage `in` $bin (`of` $lineage^)? attr-dict";
}

def Piko_CheckAssignOp : Piko_CheckOp<"assign"> {
  let summary = "an assign phase begins or ends";
  let description = [{
    Without a lineage it ends, and what was running before goes on.

    ```mlir
    piko.check_assign @shade of %lineage
    piko.check_assign @shade
    ```
  }];
  let arguments = (ins FlatSymbolRefAttr:$stage, Optional<I64>:$lineage);
  let assemblyFormat = "$stage (`of` $lineage^)? attr-dict";
}

def Piko_CheckEmitOp : Piko_CheckOp<"emit"> {
  let summary = "the lineage of the next primitive that a call emits";
  let description = [{
    ```mlir
    %lineage = piko.check_emit
    ```
  }];
  let results = (outs I64:$lineage);
  let assemblyFormat = "attr-dict";
}

def Piko_CheckPlaceOp : Piko_CheckOp<"place"> {
  let summary = "what follows may fail here";
  let description = [{
    ```mlir
    piko.check_place
    ```
  }];
  let assemblyFormat = "attr-dict";
}

def Piko_CheckAccessOp : Piko_CheckOp<"access", [
    DeclareOpInterfaceMethods<SymbolUserOpInterface>]> {
  let summary = "an element of state is accessed";
  let description = [{
    With `updates` the stage also updates this image: a read by a call that
    updates the pixel, too, is a part of the update.

    ```mlir
    piko.check_access read @lights[%i : index]
    piko.check_access read updates @depth[%x, %y : i32, i32]
    ```
  }];
  let arguments = (ins Piko_CheckedAccess:$kind, UnitAttr:$updates,
                       FlatSymbolRefAttr:$state,
                       Variadic<Piko_Coordinate>:$indices);
  let assemblyFormat = [{
    $kind (`updates` $updates^)? $state `[` $indices `:` type($indices) `]`
    attr-dict
  }];
}

def Piko_CheckLoopOp : Piko_CheckOp<"loop"> {
  let summary = "a parallel loop, an iteration or what follows a barrier begins";
  let description = [{
    `iteration` says whose the accesses are that follow, `barrier` also that it
    has passed a barrier.

    ```mlir
    piko.check_loop begin
    piko.check_loop iteration %i
    piko.check_loop barrier %i
    piko.check_loop end
    ```
  }];
  let arguments = (ins Piko_CheckedLoop:$event, Optional<Index>:$iteration);
  let assemblyFormat = "$event ($iteration^)? attr-dict";
  let hasVerifier = 1;
}

def Piko_CheckValueOp : Piko_CheckOp<"value"> {
  let summary = "a field is wrong if the flag is true";
  let description = [{
    ```mlir
    piko.check_value nan %isNaN "z" of @Fragment
    piko.check_value unwritten %isUnwritten "z" of @Fragment
    ```
  }];
  let arguments = (ins Piko_CheckedValue:$kind, I1:$flag, StrAttr:$field,
                       FlatSymbolRefAttr:$record);
  let assemblyFormat = "$kind $flag $field `of` $record attr-dict";
}

def Piko_CheckIndexOp : Piko_CheckOp<"index"> {
  let summary = "an index into an array, or 0 if it is outside";
  let description = [{
    Of a local array or of a field. An index outside is a finding, and what
    follows goes on with the first element.

    ```mlir
    %inside = piko.check_index %i of 16
    ```
  }];
  let arguments = (ins Index:$index, I64Attr:$size);
  let results = (outs Index:$inside);
  let assemblyFormat = "$index `of` $size attr-dict";
}

def Piko_CheckTripOp : Piko_CheckOp<"trip"> {
  let summary = "a loop of a phase goes round; whether it may";
  let description = [{
    The trips of all loops of a call are counted. Too many of them are a
    finding, and from there on no loop goes on.

    ```mlir
    %may = piko.check_trip
    ```
  }];
  let results = (outs I1:$may);
  let assemblyFormat = "attr-dict";
}

#endif // PIKO_DIALECT_PIKO_IR_PIKOCHECKOPS_TD
