//===- ConstantBytes.h - Evaluated values as they lie in memory -*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_FRONTEND_PARSE_CONSTANTBYTES_H
#define PIKO_LIB_FRONTEND_PARSE_CONSTANTBYTES_H

#include "clang/AST/APValue.h"
#include "clang/AST/ASTContext.h"

namespace piko {

/// The bytes of a value. Padding and what has no value are 0.
class ConstantBytes {
public:
  ConstantBytes(const clang::ASTContext &ast, clang::QualType type);

  /// Sets all of them; false for pointers and other values that no bytes hold.
  bool write(const clang::APValue &value, clang::QualType type,
             int64_t offset = 0);

  /// The number of `size` bytes, at most 8, at an offset.
  uint64_t read(int64_t offset, int64_t size) const;
  /// Whether one of so many bytes has a value.
  bool isSet(int64_t offset, int64_t size) const;

private:
  bool writeClass(const clang::APValue &value, const clang::RecordDecl *decl,
                  int64_t offset);
  bool writeField(const clang::APValue &value, const clang::FieldDecl *field,
                  int64_t offset);
  void writeBits(const llvm::APInt &bits, int64_t bitOffset);

  const clang::ASTContext *ast;
  std::vector<uint8_t> bytes;
  std::vector<bool> known;
};

} // namespace piko

#endif // PIKO_LIB_FRONTEND_PARSE_CONSTANTBYTES_H
