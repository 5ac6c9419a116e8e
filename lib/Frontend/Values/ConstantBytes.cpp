//===- ConstantBytes.cpp - Evaluated values as they lie in memory ---------===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

#include "Values/ConstantBytes.h"

#include "clang/AST/DeclCXX.h"
#include "clang/AST/RecordLayout.h"

using namespace piko;
using clang::APValue;
using clang::QualType;

ConstantBytes::ConstantBytes(const clang::ASTContext &ast, QualType type)
    : ast(&ast), bytes(ast.getTypeSizeInChars(type).getQuantity()),
      known(bytes.size()) {}

void ConstantBytes::writeBits(const llvm::APInt &bits, int64_t bitOffset) {
  for (unsigned bit = 0; bit < bits.getBitWidth(); ++bit, ++bitOffset) {
    uint8_t mask = 1 << (bitOffset % 8);
    if (bits[bit])
      bytes[bitOffset / 8] |= mask;
    known[bitOffset / 8] = true;
  }
}

bool ConstantBytes::writeField(const APValue &value,
                               const clang::FieldDecl *field, int64_t offset) {
  const clang::ASTRecordLayout &layout =
      ast->getASTRecordLayout(field->getParent());
  int64_t bit = layout.getFieldOffset(field->getFieldIndex());
  if (!field->isBitField())
    return write(value, field->getType(), offset + bit / 8);
  if (!value.hasValue())
    return true;
  writeBits(value.getInt().zextOrTrunc(field->getBitWidthValue()),
            offset * 8 + bit);
  return true;
}

bool ConstantBytes::writeClass(const APValue &value,
                               const clang::RecordDecl *decl, int64_t offset) {
  if (value.isUnion())
    return !value.getUnionField() ||
           writeField(value.getUnionValue(), value.getUnionField(), offset);
  if (!value.isStruct())
    return false;
  if (const auto *cxx = llvm::dyn_cast<clang::CXXRecordDecl>(decl))
    for (auto [number, base] : llvm::enumerate(cxx->bases())) {
      const auto *type = base.getType()->getAsCXXRecordDecl();
      int64_t at =
          ast->getASTRecordLayout(decl).getBaseClassOffset(type).getQuantity();
      if (!write(value.getStructBase(number), base.getType(), offset + at))
        return false;
    }
  for (const clang::FieldDecl *field : decl->fields())
    if (!field->isUnnamedBitField() &&
        !writeField(value.getStructField(field->getFieldIndex()), field,
                    offset))
      return false;
  return true;
}

bool ConstantBytes::write(const APValue &value, QualType type, int64_t offset) {
  if (!value.hasValue())
    return true;
  if (value.isInt()) {
    writeBits(value.getInt().zextOrTrunc(ast->getTypeSize(type)), offset * 8);
    return true;
  }
  if (value.isFloat()) {
    writeBits(value.getFloat().bitcastToAPInt(), offset * 8);
    return true;
  }
  if (const clang::RecordDecl *decl = type->getAsRecordDecl())
    return writeClass(value, decl, offset);
  if (!value.isArray() && !value.isVector())
    return false;
  QualType element = value.isArray()
                         ? ast->getAsArrayType(type)->getElementType()
                         : type->castAs<clang::VectorType>()->getElementType();
  int64_t size = ast->getTypeSizeInChars(element).getQuantity();
  unsigned count =
      value.isArray() ? value.getArraySize() : value.getVectorLength();
  for (unsigned i = 0; i < count; ++i) {
    const APValue &part = value.isVector() ? value.getVectorElt(i)
                          : i < value.getArrayInitializedElts()
                              ? value.getArrayInitializedElt(i)
                              : value.getArrayFiller();
    if (!write(part, element, offset + i * size))
      return false;
  }
  return true;
}

uint64_t ConstantBytes::read(int64_t offset, int64_t size) const {
  uint64_t number = 0;
  for (int64_t i = 0; i < size; ++i)
    number |= uint64_t(bytes[offset + i]) << (8 * i);
  return number;
}

bool ConstantBytes::isSet(int64_t offset, int64_t size) const {
  return llvm::is_contained(
      llvm::make_range(known.begin() + offset, known.begin() + offset + size),
      true);
}
