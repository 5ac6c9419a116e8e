//===- CppTypes.cpp - How a host writes the types of records --------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Parse/CppTypes.h"

#include "clang/AST/DeclTemplate.h"
#include "clang/AST/RecordLayout.h"
#include "llvm/ADT/StringSwitch.h"
#include "llvm/Support/FormatVariadic.h"

using namespace piko;
using clang::BuiltinType;
using clang::QualType;
using llvm::dyn_cast;

using Specialization = clang::ClassTemplateSpecializationDecl;

llvm::StringRef piko::getStorageName(ScalarType type) {
  switch (type) {
  case ScalarType::F32:
    return "float";
  case ScalarType::F64:
    return "double";
  case ScalarType::I8:
    return "int8_t";
  case ScalarType::I16:
    return "int16_t";
  case ScalarType::I32:
    return "int32_t";
  case ScalarType::I64:
    return "int64_t";
  }
  llvm_unreachable("all scalar types are listed");
}

static std::string getBuiltinName(const BuiltinType *type,
                                  const clang::ASTContext &ast) {
  switch (type->getKind()) {
  case BuiltinType::Bool:
    return "bool";
  case BuiltinType::Char_S:
  case BuiltinType::Char_U:
    return "char";
  case BuiltinType::WChar_S:
  case BuiltinType::WChar_U:
    return "wchar_t";
  case BuiltinType::Char8:
    return "char8_t";
  case BuiltinType::Char16:
    return "char16_t";
  case BuiltinType::Char32:
    return "char32_t";
  case BuiltinType::LongLong:
    return "long long";
  case BuiltinType::ULongLong:
    return "unsigned long long";
  case BuiltinType::Float:
    return "float";
  case BuiltinType::Double:
    return "double";
  default:
    return llvm::formatv("{0}int{1}_t", type->isUnsignedInteger() ? "u" : "",
                         ast.getTypeSize(type));
  }
}

static std::string getNumberName(QualType type, const clang::ASTContext &ast) {
  return getBuiltinName(type->castAs<BuiltinType>(), ast);
}

std::string piko::getQualifiedName(QualType type,
                                   const clang::ASTContext &ast) {
  clang::PrintingPolicy policy(ast.getLangOpts());
  policy.SuppressTagKeyword = true;
  policy.FullyQualifiedName = true;
  policy.SuppressUnwrittenScope = true;
  return QualType(ast.getCanonicalType(type).getUnqualifiedType())
      .getAsString(policy);
}

//===----------------------------------------------------------------------===//
// Classes of libraries
//===----------------------------------------------------------------------===//

static const Specialization *asTemplateOf(const clang::RecordDecl *decl,
                                          llvm::StringRef space) {
  const auto *specialization = llvm::dyn_cast_or_null<Specialization>(decl);
  if (!specialization)
    return nullptr;
  const auto *scope =
      dyn_cast<clang::NamespaceDecl>(specialization->getDeclContext());
  while (scope && scope->isInline())
    scope = dyn_cast<clang::NamespaceDecl>(scope->getParent());
  bool isThere = scope && scope->getName() == space &&
                 scope->getParent()->isTranslationUnit();
  return isThere ? specialization : nullptr;
}

bool piko::isGlmType(const clang::RecordDecl *decl) {
  const Specialization *type = asTemplateOf(decl, "glm");
  return type &&
         llvm::is_contained({llvm::StringRef("vec"), llvm::StringRef("mat"),
                             llvm::StringRef("qua")},
                            type->getName());
}

static bool isStdArray(const clang::RecordDecl *decl) {
  const Specialization *type = asTemplateOf(decl, "std");
  return type && type->getName() == "array";
}

bool piko::isLibraryType(const clang::RecordDecl *decl) {
  return isGlmType(decl) || isStdArray(decl);
}

/// The short names are those that GLM's users write.
static std::string getGlmName(const Specialization *type,
                              const clang::ASTContext &ast) {
  std::string extents, number, qualifier;
  for (const clang::TemplateArgument &argument :
       type->getTemplateArgs().asArray()) {
    if (argument.getKind() == clang::TemplateArgument::Type) {
      number = getNumberName(argument.getAsType(), ast);
      continue;
    }
    int64_t value = argument.getAsIntegral().getExtValue();
    if (const auto *kind = argument.getIntegralType()->getAsEnumDecl()) {
      for (const clang::EnumConstantDecl *constant : kind->enumerators())
        if (value != 0 && constant->getInitVal() == value)
          qualifier = ", glm::" + constant->getNameAsString();
    } else {
      extents += std::to_string(value);
    }
  }
  llvm::StringRef letter = llvm::StringSwitch<llvm::StringRef>(number)
                               .Case("float", "")
                               .Case("double", "d")
                               .Case("int32_t", "i")
                               .Case("uint32_t", "u")
                               .Case("bool", "b")
                               .Default("?");
  llvm::StringRef name = type->getName();
  bool isShort = letter != "?" && qualifier.empty() &&
                 (name == "vec" || letter.empty() || letter == "d");
  if (isShort && name == "qua")
    return llvm::formatv("glm::{0}quat", letter);
  std::string dimensions = extents;
  if (name == "mat" && extents[0] != extents[1])
    dimensions.insert(1, "x");
  else if (name == "mat")
    dimensions.pop_back();
  if (isShort)
    return llvm::formatv("glm::{0}{1}{2}", letter, name, dimensions);
  std::string arguments;
  for (char extent : extents)
    arguments += llvm::formatv("{0}, ", extent);
  return llvm::formatv("glm::{0}<{1}{2}{3}>", name, arguments, number,
                       qualifier);
}

//===----------------------------------------------------------------------===//
// Classes of the user
//===----------------------------------------------------------------------===//

namespace {

/// What the fields of a class need.
struct Extent {
  int64_t end = 0, align = 1;
};

} // namespace

static Extent getExtent(const clang::RecordDecl *decl,
                        const clang::ASTContext &ast) {
  Extent extent;
  const clang::ASTRecordLayout &layout = ast.getASTRecordLayout(decl);
  auto add = [&](int64_t offset, int64_t size, int64_t align) {
    extent.end = std::max(extent.end, offset + size);
    extent.align = std::max(extent.align, align);
  };
  if (const auto *cxx = dyn_cast<clang::CXXRecordDecl>(decl))
    for (const clang::CXXBaseSpecifier &specifier : cxx->bases()) {
      const auto *base = specifier.getType()->getAsCXXRecordDecl();
      if (base->isEmpty())
        continue;
      Extent inner = getExtent(base, ast);
      add(layout.getBaseClassOffset(base).getQuantity(), inner.end,
          inner.align);
    }
  for (const clang::FieldDecl *field : decl->fields()) {
    QualType type = field->getType();
    const auto *element = ast.getBaseElementType(type)->getAsCXXRecordDecl();
    if (field->isZeroSize(ast) || (element && element->isEmpty()))
      continue;
    add(layout.getFieldOffset(field->getFieldIndex()) / 8,
        ast.getTypeSizeInChars(type).getQuantity(),
        ast.getTypeAlignInChars(type).getQuantity());
  }
  return extent;
}

CppTypeDescription piko::describeClass(const clang::RecordDecl *decl,
                                       const clang::ASTContext &ast) {
  CppTypeDescription description;
  QualType type = ast.getCanonicalTagType(decl);
  if (isGlmType(decl))
    description.type = getGlmName(llvm::cast<Specialization>(decl), ast);
  else if (isStdArray(decl))
    description.type = "std::array";
  else if (decl->hasNameForLinkage())
    description.type = getQualifiedName(type, ast);
  else
    description.type = "struct";
  int64_t size = ast.getTypeSizeInChars(type).getQuantity();
  int64_t align = ast.getTypeAlignInChars(type).getQuantity();
  Extent extent = getExtent(decl, ast);
  if (extent.align != align ||
      int64_t(llvm::alignTo(extent.end, extent.align)) != size) {
    description.size = size;
    description.align = align;
  }
  return description;
}

//===----------------------------------------------------------------------===//
// Numbers
//===----------------------------------------------------------------------===//

CppTypeDescription piko::describeNumber(QualType type,
                                        const clang::ASTContext &ast) {
  CppTypeDescription description;
  const clang::EnumDecl *decl = type->getAsEnumDecl();
  if (!decl) {
    description.type = getNumberName(type, ast);
    return description;
  }
  std::string number =
      getNumberName(ast.getCanonicalType(decl->getIntegerType()), ast);
  description.type = getQualifiedName(type, ast);
  if (!decl->hasNameForLinkage())
    description.type = number;
  if (!decl->hasNameForLinkage() || description.type == "std::byte")
    return description;
  description.underlying = number;
  description.isScoped = decl->isScoped();
  for (const clang::EnumConstantDecl *constant : decl->enumerators()) {
    const llvm::APSInt &value = constant->getInitVal();
    description.enumerators.emplace_back(constant->getNameAsString(),
                                         value.extOrTrunc(64).getRawData()[0]);
  }
  return description;
}
