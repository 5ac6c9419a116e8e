//===- Wrappers.h - C++ text around a pipeline's phases ---------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_FRONTEND_PARSE_WRAPPERS_H
#define PIKO_LIB_FRONTEND_PARSE_WRAPPERS_H

#include "Piko/Frontend/PipelineDescription.h"
#include "llvm/ADT/StringRef.h"

namespace piko {

/// The functions that the wrapper text defines.
enum class WrapperKind { Wire, Assign, Schedule, Process, Clear };

/// The name of a wrapper; `index` is a stage's, or a piece of state's.
std::string getWrapperName(WrapperKind kind, unsigned index = 0);

/// The name of the file that they make. Where a line calls a phase, a comment
/// says how the phase is declared.
constexpr llvm::StringLiteral wrappersName = "<piko-wrappers>";
constexpr llvm::StringLiteral wrapperComment = " // ";

/// C++ that follows the user's file: one function for the constructor of the
/// pipeline, one for each phase of each stage, and one for each image's clear
/// value. `typeName` is how the pipeline's type can be written there, `suffix`
/// tells the functions from those of the file's other pipelines.
std::string generateWrappers(const PipelineDescription &pipeline,
                             llvm::StringRef typeName, llvm::StringRef suffix);

} // namespace piko

#endif // PIKO_LIB_FRONTEND_PARSE_WRAPPERS_H
