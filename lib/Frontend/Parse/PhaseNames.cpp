//===- PhaseNames.cpp - Members that look like phases ---------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Parse/PhaseNames.h"

#include "Clang/ClangDiagnostics.h"
#include "clang/AST/ASTContext.h"
#include "clang/AST/DeclTemplate.h"

using namespace piko;
using clang::CXXRecordDecl;
using clang::QualType;
using llvm::dyn_cast;
using llvm::StringRef;

static constexpr llvm::StringLiteral phases[] = {"process", "assignBin",
                                                 "schedule"};

/// A name without what spellings of it differ in.
static std::string normalize(StringRef name) {
  std::string letters = name.lower();
  llvm::erase(letters, '_');
  return letters;
}

/// The method that a member is or makes; null if it is another kind of member.
static const clang::CXXMethodDecl *getMethod(const clang::Decl *member) {
  if (const auto *made = dyn_cast<clang::FunctionTemplateDecl>(member))
    member = made->getTemplatedDecl();
  const auto *method = dyn_cast<clang::CXXMethodDecl>(member);
  return method && !method->isImplicit() && method->getIdentifier() ? method
                                                                    : nullptr;
}

static bool isCalled(const clang::CXXMethodDecl *method) {
  const clang::FunctionDecl *pattern =
      method->getTemplateInstantiationPattern();
  const clang::FunctionTemplateDecl *made =
      method->getDescribedFunctionTemplate();
  return method->isReferenced() || method->isUsed() ||
         (pattern && pattern->isReferenced()) ||
         (made && (made->isReferenced() || !made->specializations().empty()));
}

/// The phase that a name is close to; empty if there is none. Where it is close
/// only by its letters, the method must take one thing, as a phase does.
static StringRef getSimilarPhase(const clang::CXXMethodDecl *method) {
  StringRef name = method->getName();
  if (llvm::is_contained(phases, name))
    return "";
  std::string letters = normalize(name);
  for (StringRef phase : phases) {
    std::string wanted = normalize(phase);
    if (letters == wanted)
      return phase;
    if (method->getNumParams() == 1 &&
        StringRef(letters).edit_distance(wanted, true, 2) <= 2)
      return phase;
  }
  return "";
}

/// Calls `visit` for the methods of a stage and of the user's own bases.
static void
visitMethods(const CXXRecordDecl *type, const clang::SourceManager &sources,
             llvm::function_ref<void(const clang::CXXMethodDecl *)> visit) {
  if (!type || !type->hasDefinition() ||
      sources.isInSystemHeader(type->getLocation()))
    return;
  type = type->getDefinition();
  for (const clang::Decl *member : type->decls())
    if (const clang::CXXMethodDecl *method = getMethod(member))
      visit(method);
  for (const clang::CXXBaseSpecifier &base : type->bases())
    visitMethods(base.getType()->getAsCXXRecordDecl(), sources, visit);
}

static std::string getSignature(StringRef phase, StringRef primitive) {
  if (phase == "schedule")
    return "schedule(piko::BinId)";
  return (phase + "(const " + primitive + " &)").str();
}

void piko::noteSimilarNames(const CXXRecordDecl *stage, StringRef phase,
                            clang::ASTContext &ast,
                            mlir::InFlightDiagnostic &diagnostic,
                            mlir::MLIRContext &context) {
  const clang::SourceManager &sources = ast.getSourceManager();
  visitMethods(stage, sources, [&](const clang::CXXMethodDecl *method) {
    if (getSimilarPhase(method) == phase)
      diagnostic.attachNote(
          convertLocation(method->getLocation(), sources, context))
          << "'" << method->getName() << "' is here; write '" << phase << "'";
  });
}

void piko::warnAboutPhaseNames(const CXXRecordDecl *stage, StringRef primitive,
                               clang::ASTContext &ast,
                               mlir::MLIRContext &context) {
  const clang::SourceManager &sources = ast.getSourceManager();
  visitMethods(stage, sources, [&](const clang::CXXMethodDecl *method) {
    StringRef phase = getSimilarPhase(method);
    if (phase.empty() || isCalled(method))
      return;
    mlir::Location where =
        convertLocation(method->getLocation(), sources, context);
    mlir::InFlightDiagnostic warning = mlir::emitWarning(where);
    warning << "expected a phase of stage '" << stage->getName()
            << "' to be called '" << phase << "', but got '"
            << method->getName() << "', which nothing calls";
    warning.attachNote(where)
        << "write '" << getSignature(phase, primitive) << "'";
  });
}
