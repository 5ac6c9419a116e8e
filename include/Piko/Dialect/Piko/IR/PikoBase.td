// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The `piko` dialect itself, and what its other .td files share.

#ifndef PIKO_DIALECT_PIKO_IR_PIKOBASE_TD
#define PIKO_DIALECT_PIKO_IR_PIKOBASE_TD

include "mlir/IR/AttrTypeBase.td"
include "mlir/IR/EnumAttr.td"
include "mlir/IR/OpBase.td"
include "mlir/IR/SymbolInterfaces.td"
include "mlir/Interfaces/InferTypeOpInterface.td"
include "mlir/Interfaces/SideEffectInterfaces.td"

def Piko_Dialect : Dialect {
  let name = "piko";
  let cppNamespace = "::piko";
  let summary = "Programmable graphics pipelines";
  let description = [{
    A pipeline is a directed graph of stages. Each stage groups its input
    primitives into spatial bins and says in three phases how: *assign* (which
    bins does a primitive belong to?), *schedule* (when and where does a bin
    run?), *process* (what is computed, what is emitted?).

    A module goes down four levels, all but the last of them in this dialect:

    | level    | holds |
    |----------|-------|
    | authored | `piko.pipeline` with `piko.stage`s, edges and state |
    | kernels  | `piko.kernel`s that hold the phases that run together |
    | machine  | `piko.kernel`s that hold structured work: bins, items, lists |
    | target   | upstream dialects only |
  }];
  let useDefaultTypePrinterParser = 1;
  let useDefaultAttributePrinterParser = 1;
  // Marks.h names the discardable attributes.
  let hasOperationAttrVerify = 1;
}

class Piko_Op<string mnemonic, list<Trait> traits = []>
    : Op<Piko_Dialect, mnemonic, traits>;

/// What a leaf field of a record may be: a number of a C++ type.
def Piko_Scalar : AnyTypeOf<[F32, F64, I1, I8, I16, I32, I64],
                            "number of a C++ arithmetic type">;

/// What C++ divides as an integer.
def Piko_Divisible : AnyTypeOf<[I8, I16, I32, I64], "integer to divide">;

/// A cell coordinate, as C++ code computes it.
def Piko_Coordinate : AnyTypeOf<[I32, I64, Index],
                                "cell coordinate (i32, i64 or index)">;

/// Memory of a size that is known at run time.
def Piko_Bytes : MemRefRankOf<[I8], [1]>,
                 BuildableType<"::mlir::MemRefType::get("
                     "{::mlir::ShapedType::kDynamic}, $_builder.getI8Type())">;

/// A 64-bit integer that C++ reads as int64_t: sizes and numbers are compared
/// with other signed ones.
def Piko_I64Attr : TypedAttrBase<I64, "IntegerAttr",
    And<[CPred<"::llvm::isa<::mlir::IntegerAttr>($_self)">,
         CPred<"::llvm::cast<::mlir::IntegerAttr>($_self).getType()."
               "isSignlessInteger(64)">]>,
    "64-bit integer attribute"> {
  let returnType = "int64_t";
  let convertFromStorage = "$_self.getInt()";
  let constBuilderCall = "$_builder.getI64IntegerAttr($0)";
}

/// Says that an operation is below the machine level: no kernel there has it.
def Piko_TargetLevel : NativeOpTrait<"TargetLevel"> {
  let cppNamespace = "::piko";
}

#endif // PIKO_DIALECT_PIKO_IR_PIKOBASE_TD
