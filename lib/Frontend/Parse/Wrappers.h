//===- Wrappers.h - C++ text around a pipeline's phases ---------*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#ifndef PIKO_LIB_FRONTEND_PARSE_WRAPPERS_H
#define PIKO_LIB_FRONTEND_PARSE_WRAPPERS_H

#include "Piko/Frontend/PipelineDescription.h"
#include "llvm/ADT/StringRef.h"

#include <string>
#include <utility>
#include <vector>

namespace llvm {
class Function;
class Module;
} // namespace llvm

namespace piko {

/// The functions that the wrapper text defines.
enum class WrapperKind { Wire, Assign, Schedule, Process, Clear };

struct Wrapper {
  WrapperKind kind;
  unsigned index = 0; ///< of a stage, or of a piece of state
};

/// The wrappers of a pipeline by their names in its module.
class WrapperTable {
public:
  /// Adds one, and gives its name.
  llvm::StringRef add(WrapperKind kind, unsigned index);

  bool contains(const llvm::Function &function) const {
    return lookup(function);
  }
  /// Of a function that is one.
  WrapperKind getKind(const llvm::Function &function) const {
    return lookup(function)->kind;
  }
  llvm::Function &get(llvm::Module &module, WrapperKind kind,
                      unsigned index = 0) const;

  auto begin() const { return wrappers.begin(); }
  auto end() const { return wrappers.end(); }

private:
  const Wrapper *lookup(const llvm::Function &function) const;

  std::vector<std::pair<std::string, Wrapper>> wrappers;
};

/// The name of the file that they make. Where a line calls a phase, a comment
/// says how the phase is declared.
constexpr llvm::StringLiteral wrappersName = "<piko-wrappers>";
constexpr llvm::StringLiteral wrapperComment = " // ";

/// C++ that follows the user's file: one function for the constructor of the
/// pipeline, one for each phase of each stage, and one for each image's clear
/// value. `typeName` is how the pipeline's type can be written there, `suffix`
/// tells the functions from those of the file's other pipelines: it follows
/// the names that `wrappers` is given.
std::string generateWrappers(const PipelineDescription &pipeline,
                             llvm::StringRef typeName, llvm::StringRef suffix,
                             WrapperTable &wrappers);

} // namespace piko

#endif // PIKO_LIB_FRONTEND_PARSE_WRAPPERS_H
