//===- Tunables.h - Calls of piko::tunable in Clang's AST -------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_FRONTEND_PARSE_TUNABLES_H
#define PIKO_LIB_FRONTEND_PARSE_TUNABLES_H

#include "Piko/Frontend/Frontend.h"
#include "clang/AST/ASTContext.h"

namespace piko {

/// The tunables of the user's text, also of headers that it includes, in the
/// order in which they stand there. An error if two of one name differ. To be
/// called when all of the file is known.
llvm::FailureOr<std::vector<TunableDescription>>
findTunables(clang::ASTContext &ast, mlir::MLIRContext &context);

/// Reports a name that is none of these tunables'.
llvm::LogicalResult refuseTunable(llvm::StringRef name,
                                  llvm::ArrayRef<TunableDescription> tunables,
                                  mlir::Location file);

} // namespace piko

#endif // PIKO_LIB_FRONTEND_PARSE_TUNABLES_H
