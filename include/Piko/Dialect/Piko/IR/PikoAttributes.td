// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Fields of records, and the directives.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOATTRIBUTES_TD
#define PIKO_DIALECT_PIKO_IR_PIKOATTRIBUTES_TD

include "Piko/Dialect/Piko/IR/PikoBase.td"

def Piko_FieldAttr : AttrDef<Piko_Dialect, "Field"> {
  let mnemonic = "field";
  let summary = "a leaf field of a record";
  let description = [{
    A number, or an array of numbers, at a fixed place in a record. The name is
    the C++ path to it (`screenPos.x`). `counts` and `strides` (in bytes)
    describe an array, outermost dimension first; both are empty for a number.
    `#piko.field<"w" : f32[16 : 4] at 8>` is sixteen floats in a row, the
    first of them eight bytes into the record.
  }];
  let parameters = (ins
    StringRefParameter<>:$name, "::mlir::Type":$type, "int64_t":$offset,
    ArrayRefParameter<"int64_t">:$counts,
    ArrayRefParameter<"int64_t">:$strides);
  let hasCustomAssemblyFormat = 1;
  let genVerifyDecl = 1;
  let extraClassDeclaration = [{
    /// How many numbers the field holds.
    int64_t getElementCount() const;
    /// The byte offset in the record of element number `i`, counted row-major.
    int64_t getElementOffset(int64_t i) const;
  }];
}

def Piko_FieldArrayAttr : TypedArrayAttrBase<Piko_FieldAttr, "array of fields">;

/// What reports, traces and names of versions can hold as it is.
def Piko_LabelAttr : ConfinedAttr<StrAttr, [AttrConstraint<CPred<[{
    [](::llvm::StringRef text) {
      return !text.empty() && ::llvm::all_of(text, [](char c) {
        return ::llvm::isAlnum(c) || ::llvm::StringRef(" _-.()").contains(c);
      });
    }(::llvm::cast<::mlir::StringAttr>($_self).getValue())}]>,
    "of letters, digits, spaces and _-.()">]>;

def Piko_ScheduleKind : I32EnumAttr<"ScheduleKind", "where bins run", [
  I32EnumAttrCase<"LoadBalance", 0, "load_balance">,
  I32EnumAttrCase<"DirectMap", 1, "direct_map">,
  I32EnumAttrCase<"Serialize", 2, "serialize">,
  I32EnumAttrCase<"All", 3, "all">]> {
  let cppNamespace = "::piko";
}

/// The `piko.units` of a loop over units of work.
def Piko_UnitLoop : I32EnumAttr<"UnitLoop", "how threads share units of work", [
  I32EnumAttrCase<"Shared", 0, "shared">, // each takes the next one
  I32EnumAttrCase<"Serial", 1, "serial">, // one thread runs them all
  I32EnumAttrCase<"Mapped", 2, "mapped">, // each takes those of its own first
  I32EnumAttrCase<"Asked", 3, "asked">]> { // the runtime schedules each
  let cppNamespace = "::piko";
  let genSpecializedAttr = 0;
}
def Piko_UnitLoopAttr : EnumAttr<Piko_Dialect, Piko_UnitLoop, "units">;

def Piko_LaneMapping : I32EnumAttr<"LaneMapping", "what lanes are given", [
  I32EnumAttrCase<"Items", 0, "items">,
  I32EnumAttrCase<"Iterations", 1, "iterations">,
  I32EnumAttrCase<"Collapsed", 2, "collapsed">,
  I32EnumAttrCase<"One", 3, "one">]> {
  let cppNamespace = "::piko";
  let genSpecializedAttr = 0;
}
def Piko_LaneMappingAttr : EnumAttr<Piko_Dialect, Piko_LaneMapping, "lanes">;

/// The `piko.threads` of work, or of a parallel loop.
def Piko_ThreadMapping
    : I32EnumAttr<"ThreadMapping", "how the threads of a block share work", [
  I32EnumAttrCase<"One", 0, "one">,           // loops inside may be shared
  I32EnumAttrCase<"Shared", 1, "shared">,     // each takes some, in any order
  I32EnumAttrCase<"Lockstep", 2, "lockstep">, // an iteration is a thread
  I32EnumAttrCase<"Pieces", 3, "pieces">,     // shared, between barriers
  I32EnumAttrCase<"PiecesOfOne", 4, "pieces_of_one">,
  I32EnumAttrCase<"Pixels", 5, "pixels">,     // of one primitive after the other
  I32EnumAttrCase<"Collapsed", 6, "collapsed">, // pixels of many primitives
  I32EnumAttrCase<"ByCount", 7, "by_count">]> { // shared where there are many
  let cppNamespace = "::piko";
  let genSpecializedAttr = 0;
}
def Piko_ThreadMappingAttr
    : EnumAttr<Piko_Dialect, Piko_ThreadMapping, "threads">;

def Piko_Precision : I32EnumAttr<"Precision", "how exactly numbers are computed", [
  I32EnumAttrCase<"Strict", 0, "strict">,
  I32EnumAttrCase<"Contracted", 1, "contracted">,
  I32EnumAttrCase<"Relaxed", 2, "relaxed">]> {
  let cppNamespace = "::piko";
  let genSpecializedAttr = 0;
}
def Piko_PrecisionAttr : EnumAttr<Piko_Dialect, Piko_Precision, "precision">;

def Piko_StepKind : I32EnumAttr<"StepKind", "what a program does next", [
  I32EnumAttrCase<"Clear", 0, "clear">,
  I32EnumAttrCase<"Source", 1, "source">,
  I32EnumAttrCase<"Stage", 2, "stage">,
  I32EnumAttrCase<"Queue", 3, "queue">,
  I32EnumAttrCase<"Strips", 4, "strips">,
  I32EnumAttrCase<"EndStrips", 5, "end_strips">,
  I32EnumAttrCase<"Waves", 6, "waves">,
  I32EnumAttrCase<"Entry", 7, "entry">,
  I32EnumAttrCase<"Exit", 8, "exit">,
  I32EnumAttrCase<"EndWaves", 9, "end_waves">,
  I32EnumAttrCase<"Rounds", 10, "rounds">,
  I32EnumAttrCase<"EndRounds", 11, "end_rounds">,
  I32EnumAttrCase<"Host", 12, "host">]> {
  let cppNamespace = "::piko";
  let genSpecializedAttr = 0;
}

def Piko_StepAttr : AttrDef<Piko_Dialect, "Step"> {
  let mnemonic = "step";
  let summary = "a step of a program that a device runs by itself";
  let description = [{
    Of a `piko.steps`. The number is that of the state, source, stage, edge, group
    of strips, loop or cycle, as the setup declares them; `kernel` is the function
    that launches the grids of a source or stage, or, of `host`, that the host calls.
    `#piko.step<stage 3 by @P.kernel_s>` runs the kernel of stage 3, and
    `#piko.step<queue 2 member 1>` puts what it has emitted on edge 2 in a queue of
    the second stage of its loop. `pikort/grid.h` has the kinds.
  }];
  let parameters = (ins
    EnumParameter<Piko_StepKind>:$kind, "int32_t":$number,
    DefaultValuedParameter<"int32_t", "-1">:$member,
    DefaultValuedParameter<"int32_t", "-1">:$exit,
    OptionalParameter<"::mlir::FlatSymbolRefAttr">:$kernel);
  let assemblyFormat = [{
    `<` $kind $number (`member` $member^)? (`exit` $exit^)? (`by` $kernel^)? `>`
  }];
}

def Piko_DivisionKind : I32EnumAttr<"DivisionKind", "integer division", [
  I32EnumAttrCase<"QuotientS", 0, "quotient_signed">,
  I32EnumAttrCase<"QuotientU", 1, "quotient_unsigned">,
  I32EnumAttrCase<"RemainderS", 2, "remainder_signed">,
  I32EnumAttrCase<"RemainderU", 3, "remainder_unsigned">]> {
  let cppNamespace = "::piko";
}

def Piko_AtomicKind : I32EnumAttr<"AtomicKind", "atomic operation", [
  I32EnumAttrCase<"Add", 0, "add">,
  I32EnumAttrCase<"MinS", 1, "min_signed">,
  I32EnumAttrCase<"MaxS", 2, "max_signed">,
  I32EnumAttrCase<"MinU", 3, "min_unsigned">,
  I32EnumAttrCase<"MaxU", 4, "max_unsigned">,
  I32EnumAttrCase<"And", 5, "and">,
  I32EnumAttrCase<"Or", 6, "or">,
  I32EnumAttrCase<"Xor", 7, "xor">,
  I32EnumAttrCase<"AddF", 8, "add_float">]> {
  let cppNamespace = "::piko";
}

#endif // PIKO_DIALECT_PIKO_IR_PIKOATTRIBUTES_TD
