//===- RecordLayout.h - Leaf fields of C++ types ----------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_FRONTEND_PARSE_RECORDLAYOUT_H
#define PIKO_LIB_FRONTEND_PARSE_RECORDLAYOUT_H

#include "Piko/Frontend/PipelineDescription.h"
#include "mlir/IR/MLIRContext.h"
#include "clang/AST/ASTContext.h"
#include "llvm/ADT/DenseMap.h"

namespace piko {

/// The records of a translation unit, flattened and numbered as they are asked
/// for.
class RecordTable {
public:
  RecordTable(clang::ASTContext &ast, mlir::MLIRContext &context,
              std::vector<RecordDescription> &records)
      : ast(ast), context(context), records(records) {}

  /// The number of a type; reports at `user`, a member of that name, what
  /// cannot be in a record.
  llvm::FailureOr<unsigned> get(clang::QualType type, mlir::Location user,
                                llvm::StringRef member = "");

  /// How the type is written, without sugar.
  std::string getName(clang::QualType type) const;

private:
  struct Path;
  llvm::LogicalResult flatten(clang::QualType type, const Path &path,
                              RecordDescription &record);
  llvm::LogicalResult flattenClass(const clang::RecordDecl *decl,
                                   const Path &path, RecordDescription &record);
  void addClass(const clang::RecordDecl *decl, const Path &path,
                RecordDescription &record);
  void addNumber(clang::QualType type, const Path &path, ScalarType scalar,
                 RecordDescription &record);
  /// Notes at the members that keep a type of the user's from being trivially
  /// copyable; false if there is nothing to say.
  bool explainCopies(clang::QualType type,
                     mlir::InFlightDiagnostic &diagnostic);
  llvm::LogicalResult reject(const Path &path, const RecordDescription &record,
                             const llvm::Twine &what);

  clang::ASTContext &ast;
  mlir::MLIRContext &context;
  std::vector<RecordDescription> &records;
  llvm::DenseMap<clang::QualType, unsigned> numbers;
};

} // namespace piko

#endif // PIKO_LIB_FRONTEND_PARSE_RECORDLAYOUT_H
