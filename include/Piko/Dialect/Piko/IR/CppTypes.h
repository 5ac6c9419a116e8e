// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// What C++ calls things, for the headers of hosts and for messages. Nothing
// else depends on it, and a pass may drop it: a field has the type of its
// storage.

#ifndef PIKO_DIALECT_PIKO_IR_CPPTYPES_H
#define PIKO_DIALECT_PIKO_IR_CPPTYPES_H

#include "Piko/Dialect/Piko/IR/Piko.h"

#include <optional>

namespace piko {

/// Of a piko.record, types by paths.
constexpr llvm::StringLiteral cppTypesAttr = "piko.cpp_types";

/// Of a piko.stage, the name of the pipeline's member where the stage's symbol
/// is another. Of a piko.reduce, the call that it was, as "any". Of a
/// piko.fail_barrier, the call that was not made.
constexpr llvm::StringLiteral cppNameAttr = "piko.cpp_name";

/// What messages, reports and the runtime call an operation: a stage's label,
/// or that name; else its symbol, or what its own name says, as "sync".
llvm::StringRef getCppName(mlir::Operation *op);

/// An entry of piko.cpp_types.
struct CppType {
  llvm::StringRef name; ///< Without extents.
  llvm::SmallVector<int64_t, 2> extents = {};
  /// Of a class; 0 where they follow from its fields.
  int64_t size = 0, align = 0;
  /// Of an enumeration, else empty and null.
  llvm::StringRef underlying = {};
  bool isScoped = false;
  mlir::DictionaryAttr enumerators = {};
};

/// The type of a field, of a class around fields (its path is what their names
/// begin with), or of the record itself ("this").
std::optional<CppType> lookupCppType(RecordOp record, llvm::StringRef path);

/// The number in which C++ keeps an arithmetic type of <cstdint>, <cstddef> or
/// the language; null for another name.
mlir::Type getCppStorage(llvm::StringRef name, mlir::MLIRContext *context);

/// A vector, a matrix or a quaternion of GLM.
struct GlmType {
  enum Kind { Vector, Matrix, Quaternion } kind;
  int64_t count;          ///< How many numbers it has.
  llvm::StringRef number; ///< Their type.
};
std::optional<GlmType> parseGlmType(llvm::StringRef name);

/// Reports at the record what does not fit its fields.
llvm::LogicalResult verifyCppTypes(RecordOp record);

} // namespace piko

#endif // PIKO_DIALECT_PIKO_IR_CPPTYPES_H
