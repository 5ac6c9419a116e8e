//===- PipeSearch.h - Which pipelines a text has ----------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_FRONTEND_PARSE_PIPESEARCH_H
#define PIKO_LIB_FRONTEND_PARSE_PIPESEARCH_H

#include "mlir/IR/Diagnostics.h"
#include "clang/AST/DeclCXX.h"

#include <string>
#include <vector>

namespace clang {
class Sema;
} // namespace clang

namespace piko {

/// A pipeline type and the name by which the user knows it: without the
/// namespaces and classes that it is in, unless others have the same name.
struct PipeCandidate {
  std::string name;
  std::string qualifiedName;
  const clang::CXXRecordDecl *type;
  clang::SourceLocation location;
};

/// Whether a class is a stage, or, being a template's, will be one.
bool isStage(const clang::CXXRecordDecl *type);

/// The pipelines that a translation unit defines or names by an alias, in
/// order.
std::vector<PipeCandidate> findPipes(clang::Sema &sema);

/// The pipeline that `name` asks for; reports when there is none or more than
/// one would do.
llvm::FailureOr<PipeCandidate>
selectPipe(const std::vector<PipeCandidate> &pipes, llvm::StringRef name,
           mlir::Location file, clang::ASTContext &ast,
           mlir::MLIRContext &context);

} // namespace piko

#endif // PIKO_LIB_FRONTEND_PARSE_PIPESEARCH_H
