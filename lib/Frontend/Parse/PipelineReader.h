//===- PipelineReader.h - Pipelines in Clang's AST --------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_FRONTEND_PARSE_PIPELINEREADER_H
#define PIKO_LIB_FRONTEND_PARSE_PIPELINEREADER_H

#include "Parse/PipeSearch.h"
#include "Parse/RecordLayout.h"
#include "Values/InitialValues.h"
#include "clang/AST/DeclCXX.h"

namespace piko {

/// Reads what declarations say about a pipeline: its state, and its stages with
/// their ports and phases. Edges are read from the constructor's code, later.
class PipelineReader {
public:
  PipelineReader(clang::ASTContext &ast, mlir::MLIRContext &context,
                 PipelineDescription &pipeline, RecordTable &records)
      : ast(ast), context(context), pipeline(pipeline), records(records) {}

  llvm::LogicalResult read(const PipeCandidate &pipe);

  /// The C++ types of the stages, by number, and of the state.
  std::vector<const clang::CXXRecordDecl *> stageTypes;
  clang::QualType stateType;
  /// Those of the state, in the order of the description.
  std::vector<StateMember> stateMembers;

  /// Where a base of the state begins in it, in bytes.
  int64_t getStateOffset(clang::QualType base) const;

private:
  llvm::LogicalResult readState(clang::QualType type);
  /// Members that a constructor of the user's sets have a value, too.
  llvm::LogicalResult readMembers(const clang::CXXRecordDecl *decl,
                                  int64_t offset, bool hasConstructor);
  llvm::LogicalResult readMember(const clang::FieldDecl *member, int64_t offset,
                                 bool hasConstructor);
  llvm::LogicalResult readElements(const clang::FieldDecl *member,
                                   clang::QualType type,
                                   const std::string &name, int64_t offset);
  llvm::LogicalResult addState(StateDescription state,
                               const StateMember &member);
  llvm::LogicalResult readStage(const clang::FieldDecl *member);
  llvm::LogicalResult
  readTemplate(const clang::ClassTemplateSpecializationDecl *base,
               StageDescription &stage);
  llvm::LogicalResult readPhases(const clang::CXXRecordDecl *type,
                                 clang::QualType input,
                                 StageDescription &stage);
  llvm::LogicalResult checkAccess(const clang::NamedDecl *phase,
                                  const StageDescription &stage);
  llvm::LogicalResult checkParameter(const clang::NamedDecl *phase,
                                     clang::QualType input);
  mlir::Location locate(clang::SourceLocation location) const;

  clang::ASTContext &ast;
  mlir::MLIRContext &context;
  PipelineDescription &pipeline;
  RecordTable &records;
};

} // namespace piko

#endif // PIKO_LIB_FRONTEND_PARSE_PIPELINEREADER_H
