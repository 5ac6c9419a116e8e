//===- InitialValues.h - What constants and pixels begin with ---*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_FRONTEND_PARSE_INITIALVALUES_H
#define PIKO_LIB_FRONTEND_PARSE_INITIALVALUES_H

#include "Piko/Frontend/PipelineDescription.h"
#include "clang/AST/DeclCXX.h"

namespace clang {
class Sema;
} // namespace clang

namespace piko {

/// A member of the state, and the type of its value or of its pixels.
struct StateMember {
  const clang::FieldDecl *decl;
  clang::QualType type;
  /// Whether a constructor of the state may set it.
  bool isConstructed;
};

/// Evaluates the state's initial values and what its images are cleared to, by
/// Clang's constant evaluation. `members` are those of the state, in order.
/// What cannot be evaluated so has no value yet, and says why; an error if it
/// is too large for the other way to find it.
llvm::LogicalResult evaluateInitialValues(PipelineDescription &pipeline,
                                          clang::QualType state,
                                          llvm::ArrayRef<StateMember> members,
                                          clang::Sema &sema,
                                          mlir::MLIRContext &context);

} // namespace piko

#endif // PIKO_LIB_FRONTEND_PARSE_INITIALVALUES_H
