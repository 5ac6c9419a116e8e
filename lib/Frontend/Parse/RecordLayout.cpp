//===- RecordLayout.cpp - Leaf fields of C++ types ------------------------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Walks a type as Clang lays it out and lists its numbers. Of a union whose
// members have one size and place, as GLM's have, the first member counts. On
// the way it notes what C++ calls the types that the numbers do not tell.
//
//===----------------------------------------------------------------------===//

#include "Parse/RecordLayout.h"

#include "Parse/CppTypes.h"
#include "Clang/ClangDiagnostics.h"
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
  /// Of the arrays between this and the class around it: "[2][4]".
  std::string extents = {};
  /// Whether this is in a type of a library that hosts know.
  bool isKnown = false;

  Path member(llvm::StringRef field, int64_t at, mlir::Location where) const {
    Path path = *this;
    if (!field.empty()) {
      path.name = name.empty() ? field.str() : name + "." + field.str();
      path.extents.clear();
    }
    path.offset += at;
    path.location = where;
    return path;
  }
};

std::string RecordTable::getName(QualType type) const {
  return getQualifiedName(type, ast);
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
  if (type->isIncompleteType())
    return mlir::emitError(user) << "expected a type that is defined, but got '"
                                 << record.name << "'";
  if (!type.isTriviallyCopyableType(ast)) {
    mlir::InFlightDiagnostic diagnostic = mlir::emitError(user);
    diagnostic << "expected a trivially copyable type, but got '" << record.name
               << "'";
    explainCopies(type, diagnostic);
    return diagnostic;
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

/// What makes copies of a class not trivial by itself, and what it is called.
static std::pair<const clang::CXXMethodDecl *, llvm::StringRef>
findCopyFunction(const clang::CXXRecordDecl *decl) {
  for (const clang::CXXConstructorDecl *constructor : decl->ctors())
    if (constructor->isCopyOrMoveConstructor() && !constructor->isTrivial())
      return {constructor, "constructor"};
  for (const clang::CXXMethodDecl *method : decl->methods())
    if ((method->isCopyAssignmentOperator() ||
         method->isMoveAssignmentOperator()) &&
        !method->isTrivial())
      return {method, "assignment"};
  const clang::CXXDestructorDecl *destructor = decl->getDestructor();
  if (destructor && !destructor->isTrivial())
    return {destructor, "destructor"};
  return {nullptr, ""};
}

bool RecordTable::explainCopies(QualType type,
                                mlir::InFlightDiagnostic &diagnostic) {
  const clang::CXXRecordDecl *decl =
      ast.getBaseElementType(type)->getAsCXXRecordDecl();
  const clang::SourceManager &sources = ast.getSourceManager();
  if (!decl || sources.isInSystemHeader(decl->getLocation()))
    return false;
  bool found = false;
  for (const clang::CXXBaseSpecifier &base : decl->bases()) {
    found |= !base.getType().isTriviallyCopyableType(ast);
    if (!base.getType().isTriviallyCopyableType(ast) &&
        !explainCopies(base.getType(), diagnostic))
      diagnostic.attachNote(
          convertLocation(base.getBeginLoc(), sources, context))
          << "base '" << base.getType().getAsString(ast.getPrintingPolicy())
          << "' is not trivially copyable";
  }
  for (const clang::FieldDecl *field : decl->fields()) {
    if (field->getType().isTriviallyCopyableType(ast))
      continue;
    found = true;
    diagnostic.attachNote(
        convertLocation(field->getLocation(), sources, context))
        << "member '" << field->getName() << "' of type '"
        << field->getType().getAsString(ast.getPrintingPolicy())
        << "' is not trivially copyable";
    explainCopies(field->getType(), diagnostic);
  }
  if (found)
    return true;
  auto [copy, what] = findCopyFunction(decl);
  if (!copy)
    return false;
  diagnostic.attachNote(convertLocation(copy->getLocation(), sources, context))
      << "this " << what << " of '" << decl->getName() << "' is not trivial";
  return true;
}

LogicalResult RecordTable::flatten(QualType type, const Path &path,
                                   RecordDescription &record) {
  type = ast.getCanonicalType(type).getUnqualifiedType();
  if (const auto *array = ast.getAsConstantArrayType(type)) {
    Path element = path;
    element.counts.push_back(array->getZExtSize());
    element.extents += "[" + std::to_string(array->getZExtSize()) + "]";
    element.strides.push_back(
        ast.getTypeSizeInChars(array->getElementType()).getQuantity());
    return flatten(array->getElementType(), element, record);
  }
  if (const auto *decl = type->getAsRecordDecl()) {
    Path inside = path;
    inside.isKnown |= isGlmType(decl);
    size_t first = record.fields.size();
    if (llvm::failed(flattenClass(decl, inside, record)))
      return failure();
    if (!path.isKnown && record.fields.size() != first)
      addClass(decl, path, record);
    return success();
  }

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
  // Compiled code reads and writes numbers as aligned ones.
  int64_t size = ast.getTypeSizeInChars(type).getQuantity();
  auto isAligned = [&](int64_t bytes) { return bytes % size == 0; };
  if (!isAligned(record.align) || !isAligned(path.offset) ||
      !llvm::all_of(path.strides, isAligned))
    return reject(path, record, "a packed member");
  record.fields.push_back(
      {path.name, *scalar, path.offset, path.counts, path.strides});
  if (!path.isKnown)
    addNumber(type, path, *scalar, record);
  return success();
}

/// After the class's fields.
void RecordTable::addClass(const clang::RecordDecl *decl, const Path &path,
                           RecordDescription &record) {
  CppTypeDescription type = describeClass(decl, ast);
  type.path = path.name;
  type.type += path.extents;
  if (path.name.empty()) {
    // The record's name says it, unless a library defines the class or the
    // fields look like those of a plain number.
    bool isPlain = llvm::all_of(record.fields, [](const LeafField &field) {
      return llvm::StringRef(field.name).split('.').first == "value";
    });
    if (!isPlain && !isLibraryType(decl))
      return;
    type.path = "this";
  }
  record.types.push_back(std::move(type));
}

void RecordTable::addNumber(QualType type, const Path &path, ScalarType scalar,
                            RecordDescription &record) {
  CppTypeDescription number = describeNumber(type, ast);
  // A record that is an array is told from a class with one member.
  bool isArray = path.name == "value" && path.value && !path.extents.empty();
  if (number.type == getStorageName(scalar) && !isArray)
    return;
  number.path = path.name;
  number.type += path.extents;
  record.types.push_back(std::move(number));
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
