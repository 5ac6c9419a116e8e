//===- PipeSearch.cpp - Which pipelines a text has ------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// In namespaces and classes, and as aliases of templates; by their names alone
// where these tell them apart.
//
//===----------------------------------------------------------------------===//

#include "Parse/PipeSearch.h"

#include "Parse/LanguageTypes.h"
#include "Clang/ClangDiagnostics.h"
#include "clang/Basic/SourceManager.h"
#include "clang/Sema/Sema.h"
#include "llvm/ADT/StringMap.h"

using namespace piko;
using clang::CXXRecordDecl;
using clang::QualType;
using llvm::dyn_cast;
using llvm::failure;
using mlir::emitError;

static bool willDeriveFrom(const CXXRecordDecl *pattern, llvm::StringRef name);

/// Whether a type, which may be a template's, will be a piko::`name`.
static bool willBe(QualType type, llvm::StringRef name) {
  if (findPikoBase(type->getAsCXXRecordDecl(), name))
    return true;
  const auto *made = type->getAs<clang::TemplateSpecializationType>();
  const clang::TemplateDecl *of =
      made ? made->getTemplateName().getAsTemplateDecl() : nullptr;
  if (!of)
    return false;
  if (const auto *alias = dyn_cast<clang::TypeAliasTemplateDecl>(of))
    return willBe(alias->getTemplatedDecl()->getUnderlyingType(), name);
  return of->getQualifiedNameAsString() == ("piko::" + name).str() ||
         willDeriveFrom(
             llvm::dyn_cast_or_null<CXXRecordDecl>(of->getTemplatedDecl()),
             name);
}

static bool willDeriveFrom(const CXXRecordDecl *pattern, llvm::StringRef name) {
  return pattern && pattern->hasDefinition() &&
         llvm::any_of(pattern->getDefinition()->bases(),
                      [&](const clang::CXXBaseSpecifier &base) {
                        return willBe(base.getType(), name);
                      });
}

bool piko::isStage(const CXXRecordDecl *type) {
  return willDeriveFrom(type, "BasicStage");
}

/// With namespaces and classes, but for those without a name.
static std::string getQualifiedName(const clang::NamedDecl *decl) {
  std::string name = decl->getNameAsString();
  for (const clang::DeclContext *scope = decl->getDeclContext(); scope;
       scope = scope->getParent()) {
    const auto *outer = dyn_cast<clang::NamedDecl>(scope);
    if (outer && !outer->getNameAsString().empty())
      name = outer->getNameAsString() + "::" + name;
  }
  return name;
}

static void collectPipes(const clang::DeclContext *scope, clang::Sema &sema,
                         std::vector<PipeCandidate> &pipes) {
  clang::ASTContext &ast = sema.getASTContext();
  // What is in a precompiled header is none.
  for (const clang::Decl *decl : scope->noload_decls()) {
    if (const auto *space = dyn_cast<clang::NamespaceDecl>(decl)) {
      if (!space->isStdNamespace() && space->getName() != "glm")
        collectPipes(space, sema, pipes);
      continue;
    }
    if (const auto *link = dyn_cast<clang::LinkageSpecDecl>(decl)) {
      collectPipes(link, sema, pipes);
      continue;
    }
    if (ast.getSourceManager().isInSystemHeader(decl->getLocation()))
      continue;
    const CXXRecordDecl *type = nullptr;
    if (const auto *alias = dyn_cast<clang::TypedefNameDecl>(decl)) {
      QualType target = alias->getUnderlyingType();
      type = target->getAsCXXRecordDecl();
      const auto *made = llvm::dyn_cast_or_null<Specialization>(type);
      if (!made || type->isDependentContext() || target->isDependentType() ||
          !willDeriveFrom(made->getSpecializedTemplate()->getTemplatedDecl(),
                          "Pipe") ||
          !sema.isCompleteType(decl->getLocation(), target))
        continue;
    } else if (const auto *record = dyn_cast<CXXRecordDecl>(decl)) {
      if (!record->isThisDeclarationADefinition() || record->isInvalidDecl() ||
          record->isDependentContext() || record->isImplicit())
        continue;
      type = record;
    }
    const auto *named = dyn_cast<clang::NamedDecl>(decl);
    if (type && findPikoBase(type, "Pipe"))
      pipes.push_back({named->getNameAsString(), getQualifiedName(named), type,
                       decl->getLocation()});
    if (type && type == decl)
      collectPipes(type, sema, pipes);
  }
}

/// Tells those apart that have one name.
static void qualifyNames(std::vector<PipeCandidate> &pipes) {
  llvm::StringMap<unsigned> counts;
  for (const PipeCandidate &pipe : pipes)
    ++counts[pipe.name];
  for (PipeCandidate &pipe : pipes)
    if (counts[pipe.name] > 1)
      pipe.name = pipe.qualifiedName;
}

/// Instantiates a class and what it, its bases and its members name as template
/// arguments: primitives and records of state, which nothing else may need.
static void instantiate(QualType type, clang::SourceLocation location,
                        clang::Sema &sema,
                        llvm::SmallPtrSetImpl<const clang::Type *> &visited) {
  type = sema.getASTContext().getBaseElementType(type.getCanonicalType());
  if (type->isDependentType() || !type->isRecordType() ||
      !visited.insert(type.getTypePtr()).second ||
      !sema.isCompleteType(location, type))
    return;
  auto visit = [&](QualType part) {
    instantiate(part, location, sema, visited);
  };
  auto visitArguments = [&](llvm::ArrayRef<clang::TemplateArgument> arguments,
                            const auto &self) -> void {
    for (const clang::TemplateArgument &argument : arguments)
      if (argument.getKind() == clang::TemplateArgument::Type)
        visit(argument.getAsType());
      else if (argument.getKind() == clang::TemplateArgument::Pack)
        self(argument.pack_elements(), self);
  };
  const CXXRecordDecl *record = type->getAsCXXRecordDecl()->getDefinition();
  if (const auto *made = dyn_cast<Specialization>(record))
    visitArguments(made->getTemplateArgs().asArray(), visitArguments);
  for (const clang::CXXBaseSpecifier &base : record->bases())
    visit(base.getType());
  for (const clang::FieldDecl *field : record->fields())
    visit(field->getType());
}

std::vector<PipeCandidate> piko::findPipes(clang::Sema &sema) {
  std::vector<PipeCandidate> pipes;
  clang::ASTContext &ast = sema.getASTContext();
  collectPipes(ast.getTranslationUnitDecl(), sema, pipes);
  qualifyNames(pipes);
  llvm::SmallPtrSet<const clang::Type *, 32> visited;
  for (const PipeCandidate &pipe : pipes)
    instantiate(ast.getCanonicalTagType(pipe.type), pipe.location, sema,
                visited);
  return pipes;
}

llvm::FailureOr<PipeCandidate>
piko::selectPipe(const std::vector<PipeCandidate> &pipes, llvm::StringRef name,
                 mlir::Location file, clang::ASTContext &ast,
                 mlir::MLIRContext &context) {
  if (pipes.empty()) {
    emitError(file) << "expected a pipeline (a class that derives from "
                       "piko::Pipe), but the file defines none";
    return failure();
  }
  if (name.empty() && pipes.size() == 1)
    return pipes.front();
  // A name that several have is part of what each is called.
  std::string inner = ("::" + name).str();
  std::vector<const PipeCandidate *> meant;
  for (const PipeCandidate &pipe : pipes) {
    if (pipe.qualifiedName == name)
      return pipe;
    if (!name.empty() && llvm::StringRef(pipe.qualifiedName).ends_with(inner))
      meant.push_back(&pipe);
  }
  if (meant.size() == 1)
    return *meant.front();

  mlir::InFlightDiagnostic diagnostic = emitError(file);
  if (meant.size() > 1)
    diagnostic << "expected the name of one pipeline, but '" << name
               << "' is that of " << meant.size();
  else if (name.empty())
    diagnostic << "expected the name of one of the file's " << pipes.size()
               << " pipelines";
  else
    diagnostic << "expected the name of a pipeline, but got '" << name << "'";
  for (const PipeCandidate &pipe : pipes)
    if (meant.empty() || llvm::is_contained(meant, &pipe))
      diagnostic.attachNote(
          convertLocation(pipe.location, ast.getSourceManager(), context))
          << "pipeline '" << pipe.name << "' is defined here";
  return failure();
}
