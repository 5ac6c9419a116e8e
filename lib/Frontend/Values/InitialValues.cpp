//===- InitialValues.cpp - What constants and pixels begin with -----------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The whole state is evaluated, as constructors leave it; where that fails,
// member by member. A function counts as constexpr if its body can be
// evaluated: the text was not written for this evaluation, which replaces a
// program's start.
//
// What is still not known is tried once more, later, from the code that Clang
// makes of it, where the functions of piko/math.h have bodies.
//
//===----------------------------------------------------------------------===//

#include "Values/InitialValues.h"

#include "Values/ConstantBytes.h"
#include "Clang/ClangDiagnostics.h"
#include "clang/AST/DeclTemplate.h"
#include "clang/AST/ExprCXX.h"
#include "clang/AST/RecursiveASTVisitor.h"
#include "clang/Basic/DiagnosticAST.h"
#include "clang/Sema/Initialization.h"
#include "clang/Sema/Sema.h"

using namespace piko;
using clang::FunctionDecl;
using clang::QualType;

namespace {

/// Makes constexpr, for as long as it lives, what an initializer calls.
class AssumedConstexpr : public clang::RecursiveASTVisitor<AssumedConstexpr> {
public:
  AssumedConstexpr(clang::Sema &sema, clang::Expr *initializer) : sema(sema) {
    TraverseStmt(initializer);
    while (!work.empty())
      traverseBody(work.pop_back_val());
  }
  ~AssumedConstexpr() {
    for (FunctionDecl *function : changed)
      function->setConstexprKind(clang::ConstexprSpecKind::Unspecified);
  }

  bool shouldVisitImplicitCode() const { return true; }
  bool VisitCallExpr(clang::CallExpr *call) {
    add(call->getDirectCallee());
    return true;
  }
  bool VisitCXXConstructExpr(clang::CXXConstructExpr *made) {
    add(made->getConstructor());
    return true;
  }
  bool VisitCXXDefaultInitExpr(clang::CXXDefaultInitExpr *member) {
    return TraverseStmt(member->getExpr());
  }
  bool VisitCXXDefaultArgExpr(clang::CXXDefaultArgExpr *argument) {
    return TraverseStmt(argument->getExpr());
  }

private:
  void add(FunctionDecl *function) {
    if (!function || function->getBuiltinID() ||
        !seen.insert(function->getCanonicalDecl()).second)
      return;
    if (!function->isDefined() && function->isTemplateInstantiation())
      sema.InstantiateFunctionDefinition(function->getLocation(), function);
    FunctionDecl *definition = function->getDefinition();
    if (!definition)
      return;
    work.push_back(definition);
    for (FunctionDecl *declaration : definition->redecls())
      if (!declaration->isConstexpr()) {
        declaration->setConstexprKind(clang::ConstexprSpecKind::Constexpr);
        changed.push_back(declaration);
      }
  }
  void traverseBody(FunctionDecl *function) {
    if (auto *made = llvm::dyn_cast<clang::CXXConstructorDecl>(function))
      for (clang::CXXCtorInitializer *member : made->inits())
        TraverseStmt(member->getInit());
    TraverseStmt(function->getBody());
  }

  clang::Sema &sema;
  llvm::SmallPtrSet<FunctionDecl *, 16> seen;
  llvm::SmallVector<FunctionDecl *> work, changed;
};

class InitialValues {
public:
  InitialValues(clang::Sema &sema, mlir::MLIRContext &context,
                clang::SourceLocation at)
      : sema(sema), ast(sema.getASTContext()), context(context), at(at) {}

  /// What `T{}` is.
  std::optional<ConstantBytes> evaluateDefault(QualType type);
  std::optional<ConstantBytes> evaluateMember(const clang::FieldDecl *member);

  /// Why the last evaluation failed.
  std::optional<std::pair<mlir::Location, std::string>> why;

private:
  std::optional<ConstantBytes> evaluate(clang::VarDecl *variable,
                                        clang::Expr *initializer);
  clang::VarDecl *makeVariable(QualType type);

  clang::Sema &sema;
  clang::ASTContext &ast;
  mlir::MLIRContext &context;
  clang::SourceLocation at;
};

} // namespace

clang::VarDecl *InitialValues::makeVariable(QualType type) {
  type = type.getUnqualifiedType();
  auto *variable = clang::VarDecl::Create(
      ast, ast.getTranslationUnitDecl(), at, at, &ast.Idents.get("value"), type,
      ast.getTrivialTypeSourceInfo(type, at), clang::SC_None);
  variable->setImplicit();
  return variable;
}

std::optional<ConstantBytes> InitialValues::evaluate(clang::VarDecl *variable,
                                                     clang::Expr *initializer) {
  if (!initializer || initializer->isValueDependent())
    return std::nullopt;
  AssumedConstexpr assumption(sema, initializer);
  clang::APValue value;
  llvm::SmallVector<clang::PartialDiagnosticAt> notes;
  ConstantBytes bytes(ast, variable->getType());
  // At run time it is not a constant evaluation that a text could ask for.
  bool isKnown = initializer->EvaluateAsInitializer(
      value, ast, variable, notes, /*IsConstantInitializer=*/false);
  // What is evaluated to the end may have parts that nobody has set.
  isKnown |= llvm::any_of(notes, [](const clang::PartialDiagnosticAt &note) {
    return note.second.getDiagID() == clang::diag::note_constexpr_uninitialized;
  });
  if (isKnown && bytes.write(value, variable->getType()))
    return bytes;
  if (notes.empty())
    return std::nullopt;
  llvm::SmallString<128> text;
  notes.front().second.EmitToString(ast.getDiagnostics(), text);
  why.emplace(
      convertLocation(notes.front().first, ast.getSourceManager(), context),
      text.str().str());
  return std::nullopt;
}

std::optional<ConstantBytes> InitialValues::evaluateDefault(QualType type) {
  clang::VarDecl *variable = makeVariable(type);
  clang::ExprResult list = sema.ActOnInitList(at, {}, at);
  if (list.isInvalid())
    return std::nullopt;
  clang::Expr *arguments[] = {list.get()};
  auto entity = clang::InitializedEntity::InitializeVariable(variable);
  auto kind = clang::InitializationKind::CreateDirectList(at, at, at);
  clang::InitializationSequence steps(sema, entity, kind, arguments);
  if (steps.Failed()) // The code that asks for it later is an error.
    return std::nullopt;
  clang::ExprResult made = steps.Perform(sema, entity, kind, arguments);
  return made.isInvalid() ? std::nullopt : evaluate(variable, made.get());
}

std::optional<ConstantBytes>
InitialValues::evaluateMember(const clang::FieldDecl *member) {
  if (member->hasInClassInitializer())
    return evaluate(makeVariable(member->getType()),
                    member->getInClassInitializer());
  return evaluateDefault(member->getType());
}

static int64_t getSize(ScalarType type) {
  switch (type) {
  case ScalarType::I8:
    return 1;
  case ScalarType::I16:
    return 2;
  case ScalarType::F32:
  case ScalarType::I32:
    return 4;
  case ScalarType::F64:
  case ScalarType::I64:
    return 8;
  }
  llvm_unreachable("all scalar types are listed");
}

/// The numbers of a record in a value, at an offset.
static std::vector<uint64_t> readNumbers(const RecordDescription &record,
                                         const ConstantBytes &bytes,
                                         int64_t offset) {
  std::vector<uint64_t> numbers;
  for (const LeafField &field : record.fields) {
    int64_t size = getSize(field.type);
    for (int64_t i = 0, e = field.getElementCount(); i < e; ++i) {
      int64_t rest = i, at = field.offset;
      for (auto [count, stride] :
           llvm::reverse(llvm::zip(field.counts, field.strides))) {
        at += rest % count * stride;
        rest /= count;
      }
      numbers.push_back(bytes.read(offset + at, size));
    }
  }
  return numbers;
}

/// More numbers than this are too many for a call to be given.
static constexpr int64_t codeLimit = 4096;

static llvm::LogicalResult reportUnknown(const StateDescription &state,
                                         int64_t count) {
  mlir::InFlightDiagnostic error = mlir::emitError(state.location);
  error << "expected the initial value of '" << state.name << "', of " << count
        << " numbers, to be a constant expression";
  if (state.whyUnknown)
    error.attachNote(state.whyUnknown->first) << state.whyUnknown->second;
  return error;
}

llvm::LogicalResult
piko::evaluateInitialValues(PipelineDescription &pipeline, QualType stateType,
                            llvm::ArrayRef<StateMember> members,
                            clang::Sema &sema, mlir::MLIRContext &context) {
  const clang::CXXRecordDecl *decl = stateType->getAsCXXRecordDecl();
  InitialValues values(sema, context, decl->getLocation());
  std::optional<ConstantBytes> whole;
  if (llvm::any_of(pipeline.state, [](const StateDescription &state) {
        return state.hasValue;
      }))
    whole = values.evaluateDefault(stateType);
  for (auto [state, member] : llvm::zip(pipeline.state, members)) {
    const RecordDescription &record = pipeline.records[state.record];
    if (!member.isConstructed)
      values.why.reset();
    std::optional<ConstantBytes> own;
    if (state.hasValue && whole) {
      state.hasValue = whole->isSet(state.offset, record.size);
      state.clear = readNumbers(record, *whole, state.offset);
      state.isEvaluated = true;
    } else if (state.hasValue && !member.isConstructed) {
      own = values.evaluateMember(member.decl);
    } else if (state.kind == StateDescription::Image) {
      own = values.evaluateDefault(member.type);
    }
    if (own) {
      state.clear = readNumbers(record, *own, 0);
      state.isEvaluated = true;
    }
    state.whyUnknown = values.why;
    int64_t count = record.getElementCount();
    if (state.hasClear() && !state.isEvaluated && count > codeLimit)
      return reportUnknown(state, count);
  }
  return llvm::success();
}
