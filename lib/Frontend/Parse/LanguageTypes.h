//===- LanguageTypes.h - Classes of piko:: in Clang's AST -------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Types are known by their declarations (a class template of that name in
// namespace piko), never by how a user spells them.
//
//===----------------------------------------------------------------------===//
#ifndef PIKO_LIB_FRONTEND_PARSE_LANGUAGETYPES_H
#define PIKO_LIB_FRONTEND_PARSE_LANGUAGETYPES_H

#include "clang/AST/DeclTemplate.h"

namespace piko {

using Specialization = clang::ClassTemplateSpecializationDecl;

/// `decl` as a specialization of piko::`name`, or null.
const Specialization *asPikoTemplate(const clang::CXXRecordDecl *decl,
                                     llvm::StringRef name);

/// The base of `decl` that is a specialization of piko::`name`, or null.
const Specialization *findPikoBase(const clang::CXXRecordDecl *decl,
                                   llvm::StringRef name);

inline clang::QualType getTypeArgument(const Specialization *type,
                                       unsigned index) {
  return type->getTemplateArgs()[index].getAsType();
}

} // namespace piko

#endif // PIKO_LIB_FRONTEND_PARSE_LANGUAGETYPES_H
