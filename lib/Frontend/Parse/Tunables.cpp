//===- Tunables.cpp - Calls of piko::tunable in Clang's AST ---------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Declarations of the text, not of a precompiled header, are walked: calls
// stand in initializers, in arguments of templates, in defaults of members and
// parameters, and in bodies. In a template they count as they are written and,
// if they depend on its parameters, in each instance.
//
//===----------------------------------------------------------------------===//
#include "Parse/Tunables.h"

#include "Clang/ClangDiagnostics.h"
#include "clang/AST/Expr.h"
#include "clang/AST/RecursiveASTVisitor.h"
#include "clang/Basic/SourceManager.h"
#include "llvm/ADT/STLExtras.h"

#include <charconv>

using namespace piko;

namespace {

class TunableFinder : public clang::RecursiveASTVisitor<TunableFinder> {
public:
  TunableFinder(clang::ASTContext &ast, mlir::MLIRContext &context)
      : ast(ast), context(context) {}

  bool shouldVisitTemplateInstantiations() const { return true; }

  bool VisitCallExpr(clang::CallExpr *call) {
    const clang::FunctionDecl *callee = call->getDirectCallee();
    if (callee && callee->getDeclName().isIdentifier() &&
        callee->getName() == "tunable" &&
        callee->getQualifiedNameAsString() == "piko::tunable" &&
        !call->isInstantiationDependent())
      ok &= read(call);
    return true;
  }

  std::vector<TunableDescription> tunables;
  bool ok = true;

private:
  bool read(clang::CallExpr *call);
  bool readValue(clang::Expr *argument, TunableDescription &tunable);
  bool add(TunableDescription tunable);

  clang::ASTContext &ast;
  mlir::MLIRContext &context;
};

} // namespace

/// The enumerator of a value; empty if there is none.
static std::string findEnumerator(const clang::EnumDecl *type,
                                  const llvm::APSInt &value) {
  for (const clang::EnumConstantDecl *enumerator : type->enumerators())
    if (llvm::APSInt::isSameValue(enumerator->getInitVal(), value))
      return enumerator->getNameAsString();
  return "";
}

/// The shortest text that is read as this number.
static std::string writeReal(const llvm::APFloat &number) {
  char text[64];
  bool isFloat = &number.getSemantics() == &llvm::APFloat::IEEEsingle();
  double value = number.convertToDouble();
  auto [end, error] = isFloat
                          ? std::to_chars(text, std::end(text), float(value))
                          : std::to_chars(text, std::end(text), value);
  return error == std::errc() ? std::string(text, end) : "";
}

bool TunableFinder::readValue(clang::Expr *argument,
                              TunableDescription &tunable) {
  clang::Expr::EvalResult result;
  if (!argument->EvaluateAsConstantExpr(result, ast))
    return false;
  const clang::APValue &value = result.Val;
  if (value.isFloat()) {
    llvm::APFloat number = value.getFloat();
    bool isInexact = false;
    if (&number.getSemantics() != &llvm::APFloat::IEEEsingle())
      number.convert(llvm::APFloat::IEEEdouble(),
                     llvm::APFloat::rmNearestTiesToEven, &isInexact);
    tunable.values.push_back(writeReal(number));
    tunable.texts.push_back(tunable.values.back());
    return true;
  }
  if (!value.isInt())
    return false;
  clang::QualType type = argument->getType();
  tunable.texts.push_back(llvm::toString(value.getInt(), 10));
  tunable.values.push_back(tunable.texts.back());
  if (type->isBooleanType())
    tunable.values.back() = value.getInt().getBoolValue() ? "true" : "false";
  if (const clang::EnumDecl *enumeration = type->getAsEnumDecl())
    if (std::string name = findEnumerator(enumeration, value.getInt());
        !name.empty())
      tunable.values.back() = name;
  return true;
}

bool TunableFinder::read(clang::CallExpr *call) {
  mlir::Location location =
      convertLocation(call->getBeginLoc(), ast.getSourceManager(), context);
  TunableDescription tunable{.location = location};
  if (std::optional<std::string> name = call->getArg(0)->tryEvaluateString(ast))
    tunable.name = *name;
  bool isRead = !tunable.name.empty();
  for (clang::Expr *argument : llvm::drop_begin(call->arguments()))
    isRead = isRead && readValue(argument, tunable);
  if (!isRead) {
    mlir::emitError(location) << "expected a name and values that are known "
                                 "when the text is read";
    return false;
  }
  for (size_t i = 0; i < tunable.values.size(); ++i)
    if (llvm::is_contained(llvm::ArrayRef(tunable.values).take_front(i),
                           tunable.values[i])) {
      mlir::emitError(location)
          << "tunable '" << tunable.name << "' has the value "
          << tunable.values[i] << " twice";
      return false;
    }
  return add(std::move(tunable));
}

bool TunableFinder::add(TunableDescription tunable) {
  auto known = llvm::find_if(tunables, [&](const TunableDescription &other) {
    return other.name == tunable.name;
  });
  if (known == tunables.end()) {
    tunables.push_back(std::move(tunable));
    return true;
  }
  if (known->values == tunable.values && known->texts == tunable.texts)
    return true;
  mlir::InFlightDiagnostic error =
      mlir::emitError(tunable.location)
      << "tunable '" << tunable.name << "' has the values "
      << llvm::join(tunable.values, ", ") << " here";
  error.attachNote(known->location)
      << "and " << llvm::join(known->values, ", ") << " here";
  return false;
}

llvm::LogicalResult
piko::refuseTunable(llvm::StringRef name,
                    llvm::ArrayRef<TunableDescription> tunables,
                    mlir::Location file) {
  std::vector<std::string> names;
  for (const TunableDescription &tunable : tunables)
    names.push_back("'" + tunable.name + "'");
  return mlir::emitError(file)
         << "expected a tunable '" << name << "', but the text has "
         << (names.empty() ? "none" : llvm::join(names, ", "));
}

llvm::FailureOr<std::vector<TunableDescription>>
piko::findTunables(clang::ASTContext &ast, mlir::MLIRContext &context) {
  TunableFinder finder(ast, context);
  const clang::SourceManager &sources = ast.getSourceManager();
  for (clang::Decl *decl : ast.getTranslationUnitDecl()->noload_decls())
    if (!decl->isFromASTFile() &&
        !sources.isInSystemHeader(decl->getLocation()))
      finder.TraverseDecl(decl);
  if (!finder.ok)
    return llvm::failure();
  return std::move(finder.tunables);
}
