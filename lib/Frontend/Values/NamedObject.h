//===- NamedObject.h - The objects that C++ expressions name ----*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Two expressions with equal names name one object. Of two different names
// nothing is known: they may, by way of a pointer, name one object, too.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_LIB_FRONTEND_PARSE_NAMEDOBJECT_H
#define PIKO_LIB_FRONTEND_PARSE_NAMEDOBJECT_H

#include "clang/AST/ASTContext.h"
#include "clang/AST/DeclCXX.h"
#include "clang/AST/Expr.h"
#include "llvm/ADT/FoldingSet.h"

#include <map>
#include <optional>

namespace piko {

/// A variable or a part of one.
struct NamedObject {
  /// From an object to a part of it, or to what it points to.
  struct Step {
    const clang::ValueDecl *part; ///< A field or an index variable.
    int64_t number;
    bool operator==(const Step &) const = default;
    auto operator<=>(const Step &) const = default;
  };

  /// A variable; a method for what `this` points to in it; an expression for
  /// what its call gives.
  const void *root;
  const clang::ValueDecl *decl = nullptr; ///< The root, if it is one.
  std::vector<Step> steps = {};
  std::string name = {};
  const clang::Expr *call = nullptr; ///< The root, if it is one.

  /// Numbers of steps that are not an element's.
  static constexpr int64_t pointee = -1, indexVariable = -2, member = -3;

  void addStep(Step step);

  bool overlaps(const NamedObject &other) const;
  bool operator<(const NamedObject &other) const {
    return std::tie(root, steps) < std::tie(other.root, other.steps);
  }
  bool operator==(const NamedObject &other) const {
    return root == other.root && steps == other.steps;
  }
};

/// Finds names in the body of one function after the other.
class ObjectNamer {
public:
  explicit ObjectNamer(clang::ASTContext &ast) : ast(ast) {}

  /// What an lvalue names.
  std::optional<NamedObject> getObject(const clang::Expr *expr,
                                       const clang::FunctionDecl *function);
  /// What a pointer points to.
  std::optional<NamedObject> getPointee(const clang::Expr *expr,
                                        const clang::FunctionDecl *function);

private:
  using Result = std::optional<NamedObject>;
  Result getVariable(const clang::DeclRefExpr *reference,
                     const clang::FunctionDecl *function);
  Result getMember(const clang::MemberExpr *member,
                   const clang::FunctionDecl *function);
  Result getElement(Result array, const clang::Expr *index);
  Result getResult(const clang::CallExpr *call,
                   const clang::FunctionDecl *function);

  clang::ASTContext &ast;
  /// Of what a reference is bound to, which may be itself.
  unsigned depth = 0;
  /// The first of equal calls.
  std::map<llvm::FoldingSetNodeID, const clang::Expr *,
           bool (*)(const llvm::FoldingSetNodeID &,
                    const llvm::FoldingSetNodeID &)>
      calls{[](const llvm::FoldingSetNodeID &a,
               const llvm::FoldingSetNodeID &b) { return a < b; }};
};

/// The method whose `this` an expression in a function means: of a lambda, that
/// of the method around it.
const clang::FunctionDecl *getThisOwner(const clang::FunctionDecl *function);

} // namespace piko

#endif // PIKO_LIB_FRONTEND_PARSE_NAMEDOBJECT_H
