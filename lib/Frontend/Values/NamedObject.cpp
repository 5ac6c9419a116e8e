//===- NamedObject.cpp - The objects that C++ expressions name ------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Values/NamedObject.h"

#include "clang/AST/ExprCXX.h"
#include "clang/AST/LambdaCapture.h"
#include "llvm/Support/SaveAndRestore.h"

using namespace piko;
using clang::Expr;
using clang::FunctionDecl;
using llvm::dyn_cast;

bool NamedObject::overlaps(const NamedObject &other) const {
  const std::vector<Step> &more =
      steps.size() < other.steps.size() ? other.steps : steps;
  size_t common = std::min(steps.size(), other.steps.size());
  // A pointer and what it points to are two objects.
  return root == other.root &&
         std::equal(steps.begin(), steps.begin() + common,
                    other.steps.begin()) &&
         llvm::none_of(llvm::drop_begin(more, common),
                       [](Step step) { return step.number == pointee; });
}

void NamedObject::addStep(Step step) {
  steps.push_back(step);
  std::string part = step.part ? step.part->getNameAsString() : "";
  if (step.number == pointee)
    name = "*" + name;
  else if (step.number == indexVariable)
    name += "[" + part + "]";
  else if (step.number != member)
    name += "[" + std::to_string(step.number) + "]";
  else if (name == "*this")
    name = part;
  else if (!part.empty())
    name += "." + part;
}

static bool isLambda(const FunctionDecl *function) {
  const auto *method = llvm::dyn_cast_or_null<clang::CXXMethodDecl>(function);
  return method && method->getParent()->isLambda();
}

const FunctionDecl *piko::getThisOwner(const FunctionDecl *function) {
  while (isLambda(function)) {
    const clang::DeclContext *scope =
        llvm::cast<clang::CXXMethodDecl>(function)->getParent()->getParent();
    while (scope && !llvm::isa<FunctionDecl>(scope))
      scope = scope->getParent();
    if (!scope)
      break;
    function = llvm::cast<FunctionDecl>(scope);
  }
  return function;
}

/// Whether a lambda has a variable of its own for one of that name outside.
static bool isCopied(const clang::VarDecl *variable,
                     const FunctionDecl *function) {
  if (!isLambda(function))
    return false;
  const auto *method = llvm::cast<clang::CXXMethodDecl>(function);
  return llvm::any_of(method->getParent()->captures(), [&](const auto &item) {
    return item.capturesVariable() && item.getCapturedVar() == variable &&
           item.getCaptureKind() == clang::LCK_ByCopy;
  });
}

/// What is between an object and the same object by another type.
static const Expr *strip(const Expr *expr) {
  while (true) {
    expr = expr->IgnoreParens();
    if (const auto *full = dyn_cast<clang::FullExpr>(expr)) {
      expr = full->getSubExpr();
    } else if (const auto *cast = dyn_cast<clang::CastExpr>(expr)) {
      switch (cast->getCastKind()) {
      case clang::CK_NoOp:
      case clang::CK_DerivedToBase:
      case clang::CK_UncheckedDerivedToBase:
      case clang::CK_BaseToDerived:
      case clang::CK_BitCast:
      case clang::CK_LValueBitCast:
        expr = cast->getSubExpr();
        continue;
      default:
        return expr;
      }
    } else {
      return expr;
    }
  }
}

ObjectNamer::Result
ObjectNamer::getVariable(const clang::DeclRefExpr *reference,
                         const FunctionDecl *function) {
  if (const auto *binding = dyn_cast<clang::BindingDecl>(reference->getDecl()))
    return binding->getBinding() ? getObject(binding->getBinding(), function)
                                 : std::nullopt;
  const auto *variable = dyn_cast<clang::VarDecl>(reference->getDecl());
  if (!variable)
    return std::nullopt;
  variable = variable->getCanonicalDecl();
  std::string name = variable->getNameAsString();
  if (isCopied(variable, function))
    return NamedObject{function->getCanonicalDecl(),
                       nullptr,
                       {{variable, NamedObject::member}},
                       name};
  // A local reference names what it was bound to.
  const Expr *init = variable->getInit();
  if (variable->getType()->isReferenceType() && init &&
      !llvm::isa<clang::ParmVarDecl>(variable))
    if (Result target = getObject(init, function))
      if (!target->decl || !target->decl->isImplicit())
        return target;
  return NamedObject{variable, variable, {}, name};
}

ObjectNamer::Result ObjectNamer::getMember(const clang::MemberExpr *member,
                                           const FunctionDecl *function) {
  if (const auto *variable = dyn_cast<clang::VarDecl>(member->getMemberDecl()))
    return NamedObject{variable->getCanonicalDecl(),
                       variable,
                       {},
                       variable->getNameAsString()};
  const auto *field = dyn_cast<clang::FieldDecl>(member->getMemberDecl());
  Result object = member->isArrow() ? getPointee(member->getBase(), function)
                                    : getObject(member->getBase(), function);
  if (!object || !field)
    return std::nullopt;
  object->addStep({field->getCanonicalDecl(), NamedObject::member});
  return object;
}

ObjectNamer::Result ObjectNamer::getElement(Result array, const Expr *index) {
  if (!array)
    return std::nullopt;
  index = index->IgnoreParenImpCasts();
  Expr::EvalResult number;
  if (const auto *variable = dyn_cast<clang::DeclRefExpr>(index);
      variable && llvm::isa<clang::VarDecl>(variable->getDecl())) {
    array->addStep(
        {llvm::cast<clang::VarDecl>(variable->getDecl())->getCanonicalDecl(),
         NamedObject::indexVariable});
  } else if (!index->isValueDependent() && index->EvaluateAsInt(number, ast)) {
    array->addStep({nullptr, number.Val.getInt().getExtValue()});
  } else {
    return std::nullopt; // Which one is not known.
  }
  return array;
}

ObjectNamer::Result ObjectNamer::getResult(const clang::CallExpr *call,
                                           const FunctionDecl *function) {
  const FunctionDecl *callee = call->getDirectCallee();
  if (!callee)
    return std::nullopt;
  if (callee->isInStdNamespace() && call->getNumArgs() == 1 &&
      callee->getIdentifier() &&
      llvm::is_contained({"move", "forward", "as_const"}, callee->getName()))
    return getObject(call->getArg(0), function);
  const auto *operation = dyn_cast<clang::CXXOperatorCallExpr>(call);
  if (operation && operation->getOperator() == clang::OO_Subscript &&
      operation->getNumArgs() == 2)
    return getElement(getObject(call->getArg(0), function), call->getArg(1));
  // All stages of a pipeline have one state.
  std::string qualified = callee->getQualifiedNameAsString();
  if (llvm::StringRef(qualified).starts_with("piko::Uses<") &&
      callee->getNameAsString() == "state")
    return NamedObject{callee->getCanonicalDecl(), nullptr, {}, "state()"};
  llvm::FoldingSetNodeID profile;
  call->Profile(profile, ast, /*Canonical=*/true);
  const Expr *first = calls.try_emplace(profile, call).first->second;
  std::string name =
      callee->getIdentifier() ? callee->getNameAsString() + "()" : "";
  return NamedObject{first, nullptr, {}, name, first};
}

ObjectNamer::Result ObjectNamer::getObject(const Expr *expr,
                                           const FunctionDecl *function) {
  constexpr unsigned limit = 64;
  if (depth == limit)
    return std::nullopt;
  llvm::SaveAndRestore deeper(depth, depth + 1);
  expr = strip(expr);
  if (const auto *reference = dyn_cast<clang::DeclRefExpr>(expr))
    return getVariable(reference, function);
  if (const auto *member = dyn_cast<clang::MemberExpr>(expr))
    return getMember(member, function);
  if (const auto *element = dyn_cast<clang::ArraySubscriptExpr>(expr))
    return getElement(getPointee(element->getBase(), function),
                      element->getIdx());
  if (const auto *unary = dyn_cast<clang::UnaryOperator>(expr)) {
    if (unary->getOpcode() == clang::UO_Deref)
      return getPointee(unary->getSubExpr(), function);
    if (unary->isIncrementDecrementOp() && unary->isPrefix())
      return getObject(unary->getSubExpr(), function);
  }
  if (const auto *binary = dyn_cast<clang::BinaryOperator>(expr)) {
    if (binary->isAssignmentOp())
      return getObject(binary->getLHS(), function);
    if (binary->isCommaOp())
      return getObject(binary->getRHS(), function);
  }
  if (const auto *call = dyn_cast<clang::CallExpr>(expr))
    return call->isGLValue() ? getResult(call, function) : std::nullopt;
  return std::nullopt;
}

ObjectNamer::Result ObjectNamer::getPointee(const Expr *expr,
                                            const FunctionDecl *function) {
  expr = strip(expr);
  if (llvm::isa<clang::CXXThisExpr>(expr))
    return NamedObject{
        getThisOwner(function)->getCanonicalDecl(), nullptr, {}, "*this"};
  if (const auto *unary = dyn_cast<clang::UnaryOperator>(expr))
    if (unary->getOpcode() == clang::UO_AddrOf)
      return getObject(unary->getSubExpr(), function);
  if (const auto *call = dyn_cast<clang::CallExpr>(expr))
    return getResult(call, function);
  const auto *cast = dyn_cast<clang::CastExpr>(expr);
  if (!cast)
    return std::nullopt;
  if (cast->getCastKind() == clang::CK_ArrayToPointerDecay)
    return getObject(cast->getSubExpr(), function);
  if (cast->getCastKind() != clang::CK_LValueToRValue)
    return std::nullopt;
  // A pointer that stays as it is.
  const auto *reference =
      dyn_cast<clang::DeclRefExpr>(strip(cast->getSubExpr()));
  const auto *variable =
      reference ? dyn_cast<clang::VarDecl>(reference->getDecl()) : nullptr;
  if (variable && variable->getType().isConstQualified() &&
      variable->getInit() && !llvm::isa<clang::ParmVarDecl>(variable))
    if (Result target = getPointee(variable->getInit(), function))
      return target;
  Result pointer = getObject(cast->getSubExpr(), function);
  if (pointer)
    pointer->addStep({nullptr, NamedObject::pointee});
  return pointer;
}
