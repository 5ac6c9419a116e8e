//===- EvaluationOrder.h - Arguments whose order shows ----------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_FRONTEND_PARSE_EVALUATIONORDER_H
#define PIKO_LIB_FRONTEND_PARSE_EVALUATIONORDER_H

#include "mlir/IR/MLIRContext.h"
#include "clang/AST/Decl.h"

namespace piko {

/// Warns, in all that the functions call, where two arguments or operands whose
/// order C++ leaves open change one object, or one reads what the other
/// changes. Calls are followed, through references, pointers and captures.
void warnAboutEvaluationOrder(
    llvm::ArrayRef<const clang::FunctionDecl *> functions,
    clang::ASTContext &ast, mlir::MLIRContext &context);

} // namespace piko

#endif // PIKO_LIB_FRONTEND_PARSE_EVALUATIONORDER_H
