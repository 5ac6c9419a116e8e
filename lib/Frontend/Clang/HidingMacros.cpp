//===- HidingMacros.cpp - Macros named like the language ------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Clang/HidingMacros.h"

#include "mlir/IR/Diagnostics.h"
#include "Clang/ClangDiagnostics.h"
#include "clang/AST/DeclTemplate.h"
#include "clang/Lex/MacroInfo.h"

using namespace piko;
using llvm::dyn_cast;

/// The function that a member is or makes; null if it is another kind of member
/// or has no name.
static const clang::FunctionDecl *getFunction(const clang::Decl *member) {
  if (const auto *made = dyn_cast<clang::FunctionTemplateDecl>(member))
    member = made->getTemplatedDecl();
  const auto *function = dyn_cast<clang::FunctionDecl>(member);
  return function && function->getIdentifier() ? function : nullptr;
}

/// The class templates of namespace piko, whose members users call.
static llvm::SmallVector<const clang::CXXRecordDecl *>
findBases(clang::ASTContext &ast) {
  llvm::SmallVector<const clang::CXXRecordDecl *> bases;
  for (const clang::NamedDecl *space :
       ast.getTranslationUnitDecl()->lookup(&ast.Idents.get("piko"))) {
    const auto *piko = dyn_cast<clang::NamespaceDecl>(space);
    for (llvm::StringRef name : {"BasicStage", "Uses", "Pipe"})
      for (const clang::NamedDecl *found :
           piko ? piko->lookup(&ast.Idents.get(name))
                : clang::DeclContext::lookup_result())
        if (const auto *base = dyn_cast<clang::ClassTemplateDecl>(found))
          bases.push_back(base->getTemplatedDecl());
  }
  return bases;
}

static void refuse(const clang::FunctionDecl *function,
                   const clang::Preprocessor &preprocessor,
                   mlir::MLIRContext &context) {
  llvm::StringRef name = function->getName();
  const clang::MacroInfo *macro =
      preprocessor.getMacroInfo(function->getIdentifier());
  mlir::InFlightDiagnostic error = mlir::emitError(convertLocation(
      macro->getDefinitionLoc(), preprocessor.getSourceManager(), context));
  error << "a macro called '" << name << "' hides a function of the language";
  mlir::Diagnostic &note = error.attachNote();
  if (name == "emit")
    note << "with Qt, define QT_NO_KEYWORDS; else ";
  note << "write '#undef " << name << "' before the pipeline";
}

llvm::LogicalResult
piko::refuseHidingMacros(const clang::Preprocessor &preprocessor,
                         clang::ASTContext &ast, mlir::MLIRContext &context) {
  llvm::SmallPtrSet<const clang::IdentifierInfo *, 4> refused;
  for (const clang::CXXRecordDecl *base : findBases(ast))
    for (const clang::Decl *member : base->decls()) {
      const clang::FunctionDecl *function = getFunction(member);
      if (function && member->getAccess() != clang::AS_private &&
          function->getIdentifier()->hasMacroDefinition() &&
          refused.insert(function->getIdentifier()).second)
        refuse(function, preprocessor, context);
    }
  return llvm::success(refused.empty());
}
