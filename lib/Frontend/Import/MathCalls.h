//===- MathCalls.h - Functions with one meaning everywhere ------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_FRONTEND_IMPORT_MATHCALLS_H
#define PIKO_LIB_FRONTEND_IMPORT_MATHCALLS_H

#include "Parse/Parse.h"

namespace piko {

/// The definitions in piko/compiled/math.h.
constexpr llvm::StringLiteral mathPrefix = "__piko_math_";

/// The C library's name for a function that redirectMathCalls replaces, without
/// the f of float; empty if the function is not one.
llvm::StringRef getMathName(const llvm::Function &function);

/// Why such a function is not replaced; empty if it is.
std::string getMissingMath(const llvm::Function &function);

/// Replaces calls of the C library's functions by calls of Piko's own, with a
/// warning for each place in the user's text where the library's differ between
/// machines. Minima and maxima become comparisons. Whether there were any.
bool redirectMathCalls(llvm::Function &function, ParsedUnit &unit,
                       mlir::MLIRContext &context);

} // namespace piko

#endif // PIKO_LIB_FRONTEND_IMPORT_MATHCALLS_H
