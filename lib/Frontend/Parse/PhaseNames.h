//===- PhaseNames.h - Members that look like phases -------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_FRONTEND_PARSE_PHASENAMES_H
#define PIKO_LIB_FRONTEND_PARSE_PHASENAMES_H

#include "mlir/IR/Diagnostics.h"
#include "clang/AST/DeclCXX.h"

namespace piko {

/// Warns about members of a stage of `primitive` that nobody calls and whose
/// names are spelled almost as a phase's. To be called when all of the file is
/// known.
void warnAboutPhaseNames(const clang::CXXRecordDecl *stage,
                         llvm::StringRef primitive, clang::ASTContext &ast,
                         mlir::MLIRContext &context);

/// Notes at members that may have been meant as the phase.
void noteSimilarNames(const clang::CXXRecordDecl *stage, llvm::StringRef phase,
                      clang::ASTContext &ast,
                      mlir::InFlightDiagnostic &diagnostic,
                      mlir::MLIRContext &context);

} // namespace piko

#endif // PIKO_LIB_FRONTEND_PARSE_PHASENAMES_H
