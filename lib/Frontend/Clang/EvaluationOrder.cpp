//===- EvaluationOrder.cpp - Arguments whose order shows ------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// C++ leaves open in which order arguments, and the operands of most operators,
// are evaluated, and compilers differ. It shows where one changes what another
// reads or changes.
//
// Each function that a phase calls is visited once. An expression has effects:
// the objects that it reads and changes. A call has those of the function that
// it calls, with arguments in the place of parameters. Where the order is open
// the effects of arguments are compared. Only what is certain counts: of
// objects without a known name nothing is said.
//
//===----------------------------------------------------------------------===//

#include "Clang/EvaluationOrder.h"

#include "Values/NamedObject.h"
#include "mlir/IR/Diagnostics.h"
#include "Clang/ClangDiagnostics.h"
#include "clang/AST/ExprCXX.h"
#include "clang/AST/ExprConcepts.h"
#include "clang/AST/StmtCXX.h"

#include <set>

using namespace piko;
using clang::Expr;
using clang::FunctionDecl;
using clang::Stmt;
using llvm::dyn_cast;

namespace {

struct Effect {
  NamedObject object;
  bool writes;
  bool inCall;
  clang::SourceLocation at;
  /// What a function does is listed once, wherever it does it.
  bool operator<(const Effect &other) const {
    return std::tie(object, writes) < std::tie(other.object, other.writes);
  }
};
using Effects = std::vector<Effect>;

class OrderChecker {
public:
  OrderChecker(clang::ASTContext &ast, mlir::MLIRContext &context)
      : ast(ast), context(context), namer(ast) {}

  /// What a function does to objects that its callers know.
  const Effects &summarize(const FunctionDecl *function);

private:
  void visitBody(const Stmt *statement, Effects &effects);
  void visit(const Stmt *statement, Effects &effects);
  bool visitOperator(const Expr *expr, Effects &effects);
  void visitBinary(const clang::BinaryOperator *binary, Effects &effects);
  void visitCall(const clang::CallExpr *call, Effects &effects);
  void visitConstruction(const clang::CXXConstructExpr *made, Effects &effects);
  void visitUnordered(llvm::ArrayRef<const Expr *> operands,
                      llvm::StringRef kind, bool canBrace, Effects &effects);
  void addAccess(std::optional<NamedObject> object, bool writes,
                 const Expr *expr, Effects &effects);
  void addCallee(const FunctionDecl *callee, const Expr *object, bool isPointer,
                 llvm::ArrayRef<const Expr *> arguments, const Expr *call,
                 Effects &effects);
  std::optional<NamedObject> bind(const NamedObject &object,
                                  const FunctionDecl *callee,
                                  const Expr *thisObject, bool isPointer,
                                  llvm::ArrayRef<const Expr *> arguments);
  bool isLocal(const NamedObject &object) const;
  void compare(const Effects &first, const Effects &second,
               llvm::StringRef kind, bool canBrace);
  void warn(const Effect &first, const Effect &second, llvm::StringRef kind,
            bool canBrace);

  clang::ASTContext &ast;
  mlir::MLIRContext &context;
  ObjectNamer namer;
  /// The function whose body is visited.
  const FunctionDecl *function = nullptr;
  std::map<const FunctionDecl *, Effects> summaries;
  std::set<std::pair<unsigned, unsigned>> warned;
  /// Stands for what has been emitted.
  const char emissions = 0;
};

} // namespace

//===----------------------------------------------------------------------===//
// Functions
//===----------------------------------------------------------------------===//

const Effects &OrderChecker::summarize(const FunctionDecl *callee) {
  const FunctionDecl *definition = nullptr;
  const Stmt *body = callee->getBody(definition);
  auto [known, isNew] = summaries.try_emplace(callee->getCanonicalDecl());
  Effects &summary = known->second;
  if (!isNew || !body)
    return summary; // Of a function that calls itself: nothing, so far.
  const FunctionDecl *outer = std::exchange(function, definition);
  Effects effects;
  if (const auto *made = dyn_cast<clang::CXXConstructorDecl>(definition))
    for (const clang::CXXCtorInitializer *member : made->inits())
      visitBody(member->getInit(), effects);
  visitBody(body, effects);
  function = outer;
  llvm::sort(effects);
  for (Effect &effect : effects)
    if (summary.empty() || summary.back() < effect)
      summary.push_back(std::move(effect));
  return summary;
}

/// Whether an expression names what belongs to the function around it.
static bool usesLocals(const Stmt *expr) {
  if (llvm::isa<clang::CXXThisExpr>(expr))
    return true;
  if (const auto *reference = dyn_cast<clang::DeclRefExpr>(expr))
    if (const auto *variable = dyn_cast<clang::VarDecl>(reference->getDecl()))
      return !variable->hasGlobalStorage();
  return llvm::any_of(expr->children(), [](const Stmt *child) {
    return child && usesLocals(child);
  });
}

/// Whether no caller of the function that is visited knows an object by its
/// name.
bool OrderChecker::isLocal(const NamedObject &object) const {
  if (object.call && usesLocals(object.call))
    return true;
  bool isPointedTo = false;
  for (NamedObject::Step step : object.steps) {
    isPointedTo |= step.number == NamedObject::pointee;
    if (step.number == NamedObject::indexVariable &&
        step.part->getDeclContext() == function)
      return true;
  }
  const auto *variable = llvm::dyn_cast_or_null<clang::VarDecl>(object.decl);
  if (!variable || variable->hasGlobalStorage() ||
      variable->getDeclContext() != function)
    return false;
  bool isParameter = llvm::isa<clang::ParmVarDecl>(variable);
  return !isParameter ||
         (!variable->getType()->isReferenceType() && !isPointedTo);
}

void OrderChecker::visitBody(const Stmt *statement, Effects &effects) {
  if (!statement)
    return;
  Effects inside;
  if (const auto *expr = dyn_cast<Expr>(statement)) {
    visit(expr, inside);
  } else if (const auto *group = dyn_cast<clang::DeclStmt>(statement)) {
    for (const clang::Decl *decl : group->decls())
      if (const auto *variable = dyn_cast<clang::VarDecl>(decl))
        if (variable->getInit())
          visit(variable->getInit(), inside);
  } else {
    for (const Stmt *child : statement->children())
      visitBody(child, effects);
  }
  for (Effect &effect : inside)
    if (!isLocal(effect.object))
      effects.push_back(std::move(effect));
}

//===----------------------------------------------------------------------===//
// Expressions
//===----------------------------------------------------------------------===//

void OrderChecker::addAccess(std::optional<NamedObject> object, bool writes,
                             const Expr *expr, Effects &effects) {
  if (object)
    effects.push_back(
        {std::move(*object), writes, /*inCall=*/false, expr->getExprLoc()});
}

void OrderChecker::visit(const Stmt *statement, Effects &effects) {
  if (!statement ||
      llvm::isa<clang::UnaryExprOrTypeTraitExpr, clang::CXXNoexceptExpr,
                clang::CXXTypeidExpr, clang::RequiresExpr>(statement))
    return;
  if (const auto *lambda = dyn_cast<clang::LambdaExpr>(statement)) {
    for (const Expr *capture : lambda->capture_inits())
      visit(capture, effects);
    return;
  }
  if (const auto *argument = dyn_cast<clang::CXXDefaultArgExpr>(statement))
    return visit(argument->getExpr(), effects);
  if (const auto *rewritten =
          dyn_cast<clang::CXXRewrittenBinaryOperator>(statement))
    return visit(rewritten->getSemanticForm(), effects);
  if (const auto *call = dyn_cast<clang::CallExpr>(statement))
    return visitCall(call, effects);
  if (const auto *made = dyn_cast<clang::CXXConstructExpr>(statement))
    return visitConstruction(made, effects);
  if (const auto *expr = dyn_cast<Expr>(statement))
    if (visitOperator(expr, effects))
      return;
  if (const auto *group = dyn_cast<clang::DeclStmt>(statement))
    return visitBody(group, effects);
  for (const Stmt *child : statement->children())
    visit(child, effects);
}

/// False if the expression is like any other.
bool OrderChecker::visitOperator(const Expr *expr, Effects &effects) {
  if (const auto *binary = dyn_cast<clang::BinaryOperator>(expr)) {
    visitBinary(binary, effects);
    return true;
  }
  if (const auto *unary = dyn_cast<clang::UnaryOperator>(expr)) {
    visit(unary->getSubExpr(), effects);
    if (unary->isIncrementDecrementOp())
      addAccess(namer.getObject(unary->getSubExpr(), function),
                /*writes=*/true, unary, effects);
    return true;
  }
  if (const auto *cast = dyn_cast<clang::CastExpr>(expr)) {
    visit(cast->getSubExpr(), effects);
    if (cast->getCastKind() == clang::CK_LValueToRValue)
      addAccess(namer.getObject(cast->getSubExpr(), function),
                /*writes=*/false, cast, effects);
    return true;
  }
  return false;
}

void OrderChecker::visitBinary(const clang::BinaryOperator *binary,
                               Effects &effects) {
  const Expr *left = binary->getLHS(), *right = binary->getRHS();
  if (binary->isAssignmentOp()) {
    visit(right, effects);
    visit(left, effects);
    addAccess(namer.getObject(left, function), /*writes=*/true, binary,
              effects);
  } else if (binary->isLogicalOp() || binary->isCommaOp() ||
             binary->isShiftOp() || binary->isPtrMemOp()) {
    visit(left, effects);
    visit(right, effects);
  } else {
    visitUnordered({left, right}, "operand", /*canBrace=*/false, effects);
  }
}

/// Whether an operator's operands are evaluated in an order that C++ says.
static bool isOrdered(clang::OverloadedOperatorKind kind) {
  switch (kind) {
  case clang::OO_Subscript:
  case clang::OO_LessLess:
  case clang::OO_GreaterGreater:
  case clang::OO_AmpAmp:
  case clang::OO_PipePipe:
  case clang::OO_Comma:
  case clang::OO_ArrowStar:
    return true;
  default:
    return clang::CXXOperatorCallExpr::isAssignmentOp(kind);
  }
}

void OrderChecker::visitCall(const clang::CallExpr *call, Effects &effects) {
  llvm::SmallVector<const Expr *> arguments(call->arguments());
  const FunctionDecl *callee = call->getDirectCallee();
  const Expr *object = nullptr;
  bool isPointer = false, isOpen = true;
  if (const auto *operation = dyn_cast<clang::CXXOperatorCallExpr>(call)) {
    if (llvm::isa_and_nonnull<clang::CXXMethodDecl>(callee) &&
        !llvm::cast<clang::CXXMethodDecl>(callee)->isStatic())
      object = arguments.front();
    if (operation->getOperator() == clang::OO_Call && !arguments.empty()) {
      visit(arguments.front(), effects);
      arguments.erase(arguments.begin());
    } else {
      isOpen = !isOrdered(operation->getOperator());
    }
    if (isOpen && operation->getOperator() != clang::OO_Call)
      visitUnordered(arguments, "operand", /*canBrace=*/false, effects);
    else if (isOpen)
      visitUnordered(arguments, "argument", /*canBrace=*/false, effects);
    else
      for (const Expr *argument : arguments)
        visit(argument, effects);
    if (object && operation->getOperator() != clang::OO_Call)
      arguments.erase(arguments.begin());
  } else {
    if (const auto *member = dyn_cast<clang::MemberExpr>(
            call->getCallee()->IgnoreParenImpCasts())) {
      object = member->getBase();
      isPointer = member->isArrow();
    }
    visit(call->getCallee(), effects);
    visitUnordered(arguments, "argument", /*canBrace=*/false, effects);
  }
  if (callee)
    addCallee(callee, object, isPointer, arguments, call, effects);
}

void OrderChecker::visitConstruction(const clang::CXXConstructExpr *made,
                                     Effects &effects) {
  llvm::SmallVector<const Expr *> arguments(made->arguments());
  if (made->isListInitialization())
    for (const Expr *argument : arguments)
      visit(argument, effects);
  else
    visitUnordered(arguments, "argument", /*canBrace=*/true, effects);
  const clang::CXXConstructorDecl *constructor = made->getConstructor();
  if (constructor->isCopyOrMoveConstructor() && constructor->isTrivial())
    addAccess(namer.getObject(made->getArg(0), function), /*writes=*/false,
              made, effects);
  else
    addCallee(constructor, nullptr, false, arguments, made, effects);
}

void OrderChecker::visitUnordered(llvm::ArrayRef<const Expr *> operands,
                                  llvm::StringRef kind, bool canBrace,
                                  Effects &effects) {
  Effects before;
  for (const Expr *operand : operands) {
    Effects own;
    visit(operand, own);
    compare(before, own, kind, canBrace);
    llvm::append_range(before, own);
  }
  llvm::append_range(effects, before);
}

//===----------------------------------------------------------------------===//
// Calls
//===----------------------------------------------------------------------===//

/// What a function without a body is known to do.
static bool isMarker(const FunctionDecl *callee, llvm::StringRef name) {
  return callee->getIdentifier() && callee->getName() == name &&
         callee->getQualifiedNameAsString() == ("piko::marker::" + name).str();
}

void OrderChecker::addCallee(const FunctionDecl *callee, const Expr *object,
                             bool isPointer,
                             llvm::ArrayRef<const Expr *> arguments,
                             const Expr *call, Effects &effects) {
  clang::SourceLocation at = call->getExprLoc();
  if (isMarker(callee, "emit")) {
    effects.push_back({{&emissions}, /*writes=*/true, /*inCall=*/true, at});
    return;
  }
  if (isMarker(callee, "atomicFetch") && !arguments.empty())
    addAccess(namer.getPointee(arguments[0], function), /*writes=*/true, call,
              effects);
  const FunctionDecl *definition = nullptr;
  if (!callee->getBody(definition))
    return;
  for (const Effect &effect : summarize(definition))
    if (std::optional<NamedObject> bound =
            bind(effect.object, definition, object, isPointer, arguments))
      effects.push_back(
          {std::move(*bound), effect.writes, /*inCall=*/true, at});
}

/// The object of a callee as its caller knows it.
std::optional<NamedObject>
OrderChecker::bind(const NamedObject &object, const FunctionDecl *callee,
                   const Expr *thisObject, bool isPointer,
                   llvm::ArrayRef<const Expr *> arguments) {
  std::optional<NamedObject> base;
  size_t taken = 0;
  if (object.root == callee->getCanonicalDecl()) {
    if (!thisObject)
      return std::nullopt;
    base = isPointer ? namer.getPointee(thisObject, function)
                     : namer.getObject(thisObject, function);
  } else if (const auto *parameter =
                 llvm::dyn_cast_or_null<clang::ParmVarDecl>(object.decl);
             parameter && parameter->getDeclContext() == callee) {
    unsigned index = parameter->getFunctionScopeIndex();
    if (index >= arguments.size())
      return std::nullopt;
    if (parameter->getType()->isReferenceType()) {
      base = namer.getObject(arguments[index], function);
    } else if (!object.steps.empty() &&
               object.steps[0].number == NamedObject::pointee) {
      base = namer.getPointee(arguments[index], function);
      taken = 1;
    }
  } else {
    return object;
  }
  if (!base)
    return std::nullopt;
  for (NamedObject::Step step : llvm::drop_begin(object.steps, taken))
    base->addStep(step);
  return base;
}

//===----------------------------------------------------------------------===//
// Warnings
//===----------------------------------------------------------------------===//

/// Whether -Wunsequenced sees an effect.
static bool isClangs(const Effect &effect) {
  return !effect.inCall && effect.object.decl && effect.object.steps.empty();
}

void OrderChecker::compare(const Effects &first, const Effects &second,
                           llvm::StringRef kind, bool canBrace) {
  const Effect *reads = nullptr, *other = nullptr;
  for (const Effect &a : first)
    for (const Effect &b : second) {
      if ((!a.writes && !b.writes) || !a.object.overlaps(b.object) ||
          (isClangs(a) && isClangs(b)))
        continue;
      if (a.writes && b.writes)
        return warn(a, b, kind, canBrace);
      if (!reads)
        reads = &a, other = &b;
    }
  if (reads)
    warn(*reads, *other, kind, canBrace);
}

void OrderChecker::warn(const Effect &first, const Effect &second,
                        llvm::StringRef kind, bool canBrace) {
  const clang::SourceManager &sources = ast.getSourceManager();
  clang::SourceLocation a = sources.getExpansionLoc(first.at),
                        b = sources.getExpansionLoc(second.at);
  if (sources.isInSystemHeader(b) ||
      !warned.insert({a.getRawEncoding(), b.getRawEncoding()}).second)
    return;
  const NamedObject &object =
      first.object.name.size() > second.object.name.size() ? first.object
                                                           : second.object;
  mlir::InFlightDiagnostic warning =
      mlir::emitWarning(convertLocation(b, sources, context));
  if (object.root == &emissions)
    warning << "primitives are emitted by two " << kind << "s";
  else if (first.writes && second.writes)
    warning << "'" << object.name << "' is changed by two " << kind << "s";
  else
    warning << "'" << object.name << "' is changed by one " << kind
            << " and read by another";
  warning << " whose order C++ leaves open: a plain C++ build of this file may "
             "differ";
  warning.attachNote(convertLocation(a, sources, context))
      << "the other " << kind << " is here; "
      << (canBrace ? "braces in the place of the parentheses are evaluated "
                     "from left to right"
                   : "variables of their own give them an order");
}

void piko::warnAboutEvaluationOrder(
    llvm::ArrayRef<const FunctionDecl *> functions, clang::ASTContext &ast,
    mlir::MLIRContext &context) {
  OrderChecker checker(ast, context);
  for (const FunctionDecl *function : functions)
    checker.summarize(function);
}
