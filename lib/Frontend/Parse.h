//===- Parse.h - Running Clang on a pipeline's file -------------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_FRONTEND_PARSE_H
#define PIKO_LIB_FRONTEND_PARSE_H

#include "Markers.h"
#include "Piko/Frontend/Frontend.h"
#include "PipelineReader.h"
#include "llvm/ADT/StringSet.h"
#include "llvm/IR/LLVMContext.h"
#include "llvm/IR/Module.h"

namespace piko {

/// What is asked of a file.
enum class ParseGoal { ListPipes, DescribePipe, CompilePipe };

struct ParseRequest {
  std::string file;
  /// The file's text, where it is not on disk.
  std::optional<std::string> text;
  const FrontendOptions &options;
  ParseGoal goal;
};

/// What comes out: with ListPipes the names alone.
struct ParsedUnit {
  explicit ParsedUnit(mlir::Location file) : pipeline{.location = file} {}

  std::vector<std::string> pipes;
  PipelineDescription pipeline;
  /// The wrappers and all they need.
  std::unique_ptr<llvm::LLVMContext> llvmContext;
  std::unique_ptr<llvm::Module> module;
  /// The meaning of the module's functions without a body.
  MarkerTable markers;
  /// What a user calls a function, by its name in the module.
  std::map<std::string, std::string> functionNames;
  /// The files whose lines diagnostics should point at.
  llvm::StringSet<> userFiles;
  /// Where a call of the C library has been warned about.
  llvm::DenseSet<mlir::Attribute> warned;
};

/// Parses the file and generates LLVM IR for its phases, uncleaned; null after
/// an error.
std::unique_ptr<ParsedUnit> parseUnit(const ParseRequest &request,
                                      mlir::MLIRContext &context);

} // namespace piko

#endif // PIKO_LIB_FRONTEND_PARSE_H
