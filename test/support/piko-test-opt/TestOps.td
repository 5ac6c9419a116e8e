// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Operations of another dialect in phases: what a project that embeds the piko
// dialect would add. Passes know them by interfaces alone.

include "Piko/Dialect/Piko/IR/PikoBase.td"
include "Piko/Dialect/Piko/IR/PikoInterfaces.td"

def Test_Dialect : Dialect {
  let name = "piko_test";
  let cppNamespace = "::piko::test";
}

class Test_Op<string mnemonic, list<Trait> traits = []>
    : Op<Test_Dialect, mnemonic, traits>;

/// Puts the primitive into two bins, the lesser one first.
def Test_AssignPairOp : Test_Op<"assign_pair", [
    DeclareOpInterfaceMethods<Piko_AssignmentInterface>]> {
  let arguments = (ins Index:$a, Index:$b);
  let assemblyFormat = "$a `,` $b attr-dict";
}

/// Puts the primitive into the bin that it was emitted from.
def Test_StayOp : Test_Op<"stay", [
    DeclareOpInterfaceMethods<Piko_AssignmentInterface,
                              ["keepsBin", "canFail"]>]> {
  let assemblyFormat = "attr-dict";
}

/// Emits a record of which all numbers are the same.
def Test_EmitSameOp : Test_Op<"emit_same", [Piko_EmissionInterface]> {
  let arguments = (ins ConfinedAttr<Piko_I64Attr, [IntNonNegative]>:$port,
                       I32:$value,
                       ConfinedAttr<Piko_I64Attr, [IntNonNegative]>:$times);
  let assemblyFormat = "$port $value `times` $times attr-dict";
  let extraClassDeclaration = [{
    ::llvm::SmallVector<::mlir::Value> getNumbers() {
      return ::llvm::SmallVector<::mlir::Value>(getTimes(), getValue());
    }
  }];
}

/// Emits, it says, but has no effect.
def Test_EmitNothingOp : Test_Op<"emit_nothing", [
    Pure, Piko_EmissionInterface]> {
  let assemblyFormat = "attr-dict";
  let extraClassDeclaration = [{
    int64_t getPort() { return 0; }
    ::llvm::SmallVector<::mlir::Value> getNumbers() { return {}; }
  }];
}

/// Updates a pixel that nobody knows.
def Test_SmearOp : Test_Op<"smear", [
    MemoryEffects<[MemRead, MemWrite]>,
    DeclareOpInterfaceMethods<Piko_StateAccessInterface>]> {
  let arguments = (ins FlatSymbolRefAttr:$state);
  let assemblyFormat = "$state attr-dict";
}

/// Writes an element of a buffer.
def Test_ScribbleOp : Test_Op<"scribble", [
    MemoryEffects<[MemWrite]>,
    DeclareOpInterfaceMethods<Piko_StateAccessInterface>]> {
  let arguments = (ins FlatSymbolRefAttr:$state, Index:$index);
  let assemblyFormat = "$state `[` $index `]` attr-dict";
}

/// Reads an element of a buffer.
def Test_PeekOp : Test_Op<"peek", [
    MemoryEffects<[MemRead]>,
    DeclareOpInterfaceMethods<Piko_StateAccessInterface>]> {
  let arguments = (ins FlatSymbolRefAttr:$state, Index:$index);
  let results = (outs I32:$result);
  let assemblyFormat = "$state `[` $index `]` attr-dict";
}

/// Runs its body a few times, in a way that nobody knows.
def Test_EachOp : Test_Op<"each", [
    SingleBlock, NoTerminator, AutomaticAllocationScope, RecursiveMemoryEffects,
    DeclareOpInterfaceMethods<Piko_ParallelLoopInterface>]> {
  let regions = (region SizedRegion<1>:$body);
  let assemblyFormat = "attr-dict-with-keyword $body";
}

/// Iterations meet, in a way that nobody knows.
def Test_MeetOp : Test_Op<"meet", [
    DeclareOpInterfaceMethods<Piko_BarrierInterface>]> {
  let assemblyFormat = "attr-dict";
}

/// Says nothing of what it does.
def Test_MysteryOp : Test_Op<"mystery"> {
  let assemblyFormat = "attr-dict";
}
