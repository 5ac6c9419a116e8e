//===- CppTypes.h - How a host writes the types of records ------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// The names that `piko.cpp_types` has for C++ types. They are the same on every
// machine with the host's layout: `uint32_t`, not `unsigned int`.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_LIB_FRONTEND_PARSE_CPPTYPES_H
#define PIKO_LIB_FRONTEND_PARSE_CPPTYPES_H

#include "Piko/Frontend/PipelineDescription.h"
#include "clang/AST/ASTContext.h"

namespace piko {

/// A type without sugar, with the namespaces that are written.
std::string getQualifiedName(clang::QualType type,
                             const clang::ASTContext &ast);

/// What a host calls a number whose type nobody says.
llvm::StringRef getStorageName(ScalarType type);

/// Whether hosts have the class from GLM, as a whole.
bool isGlmType(const clang::RecordDecl *decl);

/// Whether it is one of these, or a std::array.
bool isLibraryType(const clang::RecordDecl *decl);

/// The name of a class; "struct" if it has none.
CppTypeDescription describeClass(const clang::RecordDecl *decl,
                                 const clang::ASTContext &ast);

/// The name of an arithmetic type, or an enumeration with its enumerators.
CppTypeDescription describeNumber(clang::QualType type,
                                  const clang::ASTContext &ast);

} // namespace piko

#endif // PIKO_LIB_FRONTEND_PARSE_CPPTYPES_H
