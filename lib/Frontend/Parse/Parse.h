//===- Parse.h - Running Clang on a pipeline's file -------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_FRONTEND_PARSE_PARSE_H
#define PIKO_LIB_FRONTEND_PARSE_PARSE_H

#include "Parse/PipelineReader.h"
#include "Parse/Wrappers.h"
#include "Piko/Frontend/Frontend.h"
#include "Support/Markers.h"
#include "llvm/ADT/StringSet.h"
#include "llvm/IR/DebugInfoMetadata.h"
#include "llvm/IR/LLVMContext.h"
#include "llvm/IR/Module.h"

namespace piko {

/// What is asked of a file.
enum class ParseGoal { ListPipes, ListTunables, CompilePipe, CompileAll };

struct ParseRequest {
  std::string file;
  /// The file's text, where it is not on disk.
  std::optional<std::string> text;
  const FrontendOptions &options;
  ParseGoal goal;
};

/// One pipeline.
struct ParsedUnit {
  explicit ParsedUnit(mlir::Location file) : pipeline{.location = file} {}

  PipelineDescription pipeline;
  /// Shared by the units of a file.
  std::shared_ptr<llvm::LLVMContext> llvmContext;
  /// The wrappers and all they need; null if the pipeline has an error.
  std::unique_ptr<llvm::Module> module;
  WrapperTable wrappers;
  /// The meaning of the module's functions without a body.
  MarkerTable markers;
  /// What a user calls a function, by its name in the module.
  std::map<std::string, std::string> functionNames;
  /// The same by what is left of a function when it has been inlined.
  llvm::DenseMap<const llvm::DISubprogram *, std::string> programNames;
  /// The files whose lines diagnostics should point at.
  llvm::StringSet<> userFiles;
  /// Where a call of the C library has been warned about.
  llvm::DenseSet<mlir::Attribute> warned;
};

struct ParsedFile {
  /// The names of all pipelines, in the order of their definition.
  std::vector<std::string> pipes;
  /// What ListTunables asks for.
  std::vector<TunableDescription> tunables;
  /// The pipelines that were asked for.
  std::vector<std::unique_ptr<ParsedUnit>> units;
};

/// Parses the file and generates LLVM IR for the phases of its pipelines,
/// uncleaned. Fails if there is an error in the file, or in the one pipeline of
/// CompilePipe.
llvm::FailureOr<ParsedFile> parseFile(const ParseRequest &request,
                                      mlir::MLIRContext &context);

} // namespace piko

#endif // PIKO_LIB_FRONTEND_PARSE_PARSE_H
