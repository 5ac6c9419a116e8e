//===- RecordLayout.cpp - Leaf fields of C++ types ------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Walks a type as Clang lays it out and lists its numbers. Of a union whose
// members have one size and place, as GLM's have, the first member counts.
//
//===----------------------------------------------------------------------===//

#include "RecordLayout.h"

#include "ClangDiagnostics.h"
#include "clang/AST/DeclCXX.h"
#include "clang/AST/RecordLayout.h"

using namespace piko;
using clang::QualType;
using llvm::failure;
using llvm::LogicalResult;
using llvm::success;

/// Where the walk is, seen from the record that it began at.
struct RecordTable::Path {
  std::string name;
  int64_t offset = 0;
  llvm::SmallVector<int64_t, 2> counts, strides;
  mlir::Location location;
  /// Of a value that is no class: what the user calls it, or nothing.
  std::optional<llvm::StringRef> value = std::nullopt;

  Path member(llvm::StringRef field, int64_t at, mlir::Location where) const {
    Path path = *this;
    if (!field.empty())
      path.name = name.empty() ? field.str() : name + "." + field.str();
    path.offset += at;
    path.location = where;
    return path;
  }
};

std::string RecordTable::getName(QualType type) const {
  clang::PrintingPolicy policy(ast.getLangOpts());
  policy.SuppressTagKeyword = true;
  policy.FullyQualifiedName = true;
  policy.SuppressUnwrittenScope = true;
  return QualType(ast.getCanonicalType(type).getUnqualifiedType())
      .getAsString(policy);
}

LogicalResult RecordTable::reject(const Path &path,
                                  const RecordDescription &record,
                                  const llvm::Twine &what) {
  mlir::InFlightDiagnostic diagnostic = mlir::emitError(path.location)
                                        << "not supported in Piko: " << what
                                        << " in type '" << record.name << "'";
  llvm::StringRef name = path.name;
  std::string called = name.str();
  if (path.value) {
    name.consume_front("value");
    called = (*path.value + name).str();
  }
  if (!called.empty())
    diagnostic << ", member '" << called << "'";
  return diagnostic;
}

llvm::FailureOr<unsigned> RecordTable::get(QualType type, mlir::Location user,
                                           llvm::StringRef member) {
  type = ast.getCanonicalType(type).getUnqualifiedType();
  auto known = numbers.find(type);
  if (known != numbers.end())
    return known->second;

  RecordDescription record;
  record.name = getName(type);
  if (!type.isTriviallyCopyableType(ast)) {
    mlir::emitError(user) << "expected a trivially copyable type, but got '"
                          << record.name << "'";
    return failure();
  }
  record.size = ast.getTypeSizeInChars(type).getQuantity();
  record.align = ast.getTypeAlignInChars(type).getQuantity();
  Path path{"", 0, {}, {}, user};
  if (!type->isRecordType()) {
    path.name = "value";
    path.value = member;
  }
  if (llvm::failed(flatten(type, path, record)))
    return failure();
  numbers[type] = records.size();
  records.push_back(std::move(record));
  return records.size() - 1;
}

LogicalResult RecordTable::flatten(QualType type, const Path &path,
                                   RecordDescription &record) {
  type = ast.getCanonicalType(type).getUnqualifiedType();
  if (const auto *array = ast.getAsConstantArrayType(type)) {
    Path element = path;
    element.counts.push_back(array->getZExtSize());
    element.strides.push_back(
        ast.getTypeSizeInChars(array->getElementType()).getQuantity());
    return flatten(array->getElementType(), element, record);
  }
  if (const auto *decl = type->getAsRecordDecl())
    return flattenClass(decl, path, record);

  std::optional<ScalarType> scalar;
  if (type->isSpecificBuiltinType(clang::BuiltinType::Float)) {
    scalar = ScalarType::F32;
  } else if (type->isSpecificBuiltinType(clang::BuiltinType::Double)) {
    scalar = ScalarType::F64;
  } else if (type->isIntegralOrEnumerationType()) {
    switch (ast.getTypeSize(type)) {
    case 8:
      scalar = ScalarType::I8;
      break;
    case 16:
      scalar = ScalarType::I16;
      break;
    case 32:
      scalar = ScalarType::I32;
      break;
    case 64:
      scalar = ScalarType::I64;
      break;
    }
  }
  if (!scalar) {
    if (type->isPointerType() || type->isReferenceType() ||
        type->isMemberPointerType())
      return reject(path, record, "a pointer or reference");
    return reject(path, record, "a value of type '" + getName(type) + "'");
  }
  record.fields.push_back(
      {path.name, *scalar, path.offset, path.counts, path.strides});
  return success();
}

LogicalResult RecordTable::flattenClass(const clang::RecordDecl *decl,
                                        const Path &path,
                                        RecordDescription &record) {
  const clang::ASTRecordLayout &layout = ast.getASTRecordLayout(decl);
  if (const auto *cxx = llvm::dyn_cast<clang::CXXRecordDecl>(decl)) {
    if (cxx->isDynamicClass())
      return reject(path, record, "a class with virtual functions or bases");
    for (const clang::CXXBaseSpecifier &base : cxx->bases()) {
      const auto *baseDecl = base.getType()->getAsCXXRecordDecl();
      if (baseDecl->isEmpty())
        continue;
      int64_t at = layout.getBaseClassOffset(baseDecl).getQuantity();
      if (llvm::failed(flattenClass(
              baseDecl, path.member("", at, path.location), record)))
        return failure();
    }
  }
  for (const clang::FieldDecl *field : decl->fields()) {
    mlir::Location where =
        convertLocation(field->getLocation(), ast.getSourceManager(), context);
    int64_t bits = layout.getFieldOffset(field->getFieldIndex());
    Path member = path.member(field->getName(), bits / 8, where);
    if (field->isBitField())
      return reject(member, record, "a bit-field");
    if (field->isZeroSize(ast))
      continue;
    if (llvm::failed(flatten(field->getType(), member, record)))
      return failure();
    if (decl->isUnion()) {
      if (ast.getTypeSize(field->getType()) !=
          static_cast<uint64_t>(ast.toBits(layout.getDataSize())))
        return reject(member, record, "a union of members of different sizes");
      break;
    }
  }
  return success();
}
