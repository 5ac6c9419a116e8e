//===- HidingMacros.h - Macros named like the language ----------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_FRONTEND_PARSE_HIDINGMACROS_H
#define PIKO_LIB_FRONTEND_PARSE_HIDINGMACROS_H

#include "mlir/IR/MLIRContext.h"
#include "clang/AST/ASTContext.h"
#include "clang/Lex/Preprocessor.h"

namespace piko {

/// Refuses macros that have the name of a function which stages and pipelines
/// inherit: Qt's `emit` expands to nothing, and an emission would compile to an
/// expression without effect. To be called when all of the file is known.
llvm::LogicalResult refuseHidingMacros(const clang::Preprocessor &preprocessor,
                                       clang::ASTContext &ast,
                                       mlir::MLIRContext &context);

} // namespace piko

#endif // PIKO_LIB_FRONTEND_PARSE_HIDINGMACROS_H
