//===- LanguageTypes.cpp - Classes of piko:: in Clang's AST ---------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Parse/LanguageTypes.h"

using namespace piko;
using clang::CXXRecordDecl;
using llvm::dyn_cast;

const Specialization *piko::asPikoTemplate(const CXXRecordDecl *decl,
                                           llvm::StringRef name) {
  const auto *specialization = llvm::dyn_cast_or_null<Specialization>(decl);
  if (!specialization || specialization->getName() != name)
    return nullptr;
  const auto *space =
      dyn_cast<clang::NamespaceDecl>(specialization->getDeclContext());
  bool isPiko = space && space->getName() == "piko" &&
                space->getParent()->isTranslationUnit();
  return isPiko ? specialization : nullptr;
}

const Specialization *piko::findPikoBase(const CXXRecordDecl *decl,
                                         llvm::StringRef name) {
  if (!decl || !decl->hasDefinition())
    return nullptr;
  if (const Specialization *self = asPikoTemplate(decl, name))
    return self;
  for (const clang::CXXBaseSpecifier &base : decl->bases())
    if (const Specialization *found =
            findPikoBase(base.getType()->getAsCXXRecordDecl(), name))
      return found;
  return nullptr;
}
