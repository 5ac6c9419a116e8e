//===- CallChain.h - How a user's text leads to an instruction --*- C++ -*-===//
// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// An error belongs to the user's own line, also where a header does what is
// wrong. Notes say how the one leads to the other, and which calls in the
// user's text lead there.
//
//===----------------------------------------------------------------------===//

#ifndef PIKO_LIB_FRONTEND_SUPPORT_CALLCHAIN_H
#define PIKO_LIB_FRONTEND_SUPPORT_CALLCHAIN_H

#include "Parse/Parse.h"
#include "mlir/IR/Diagnostics.h"
#include "llvm/IR/DebugInfoMetadata.h"

namespace piko {

class CallChain {
public:
  explicit CallChain(const ParsedUnit &unit) : unit(unit) {}
  /// The calls that have been inlined around an instruction.
  CallChain(const llvm::Instruction *instruction, const ParsedUnit &unit);

  /// Adds a place, from the innermost on, and what is called there, if that is
  /// known.
  void add(const llvm::DILocation *at, llvm::StringRef callee);

  /// What the user's text calls where the error is; empty if the error is about
  /// that place itself.
  llvm::StringRef getUserCallee() const;
  mlir::Location getLocation(mlir::MLIRContext &context) const;
  /// Begins an error that has its notes already.
  mlir::InFlightDiagnostic emitError(mlir::MLIRContext &context) const;

private:
  struct CallSite {
    const llvm::DILocation *at;
    std::string callee;
  };
  bool isUsers(const CallSite &frame) const;
  /// The place of the error: the innermost in the user's text.
  size_t findUserFrame() const;
  void attachCallsAfter(mlir::InFlightDiagnostic &error, size_t place,
                        mlir::MLIRContext &context) const;
  void attachCallers(mlir::InFlightDiagnostic &error, size_t place,
                     mlir::MLIRContext &context) const;

  const ParsedUnit &unit;
  std::vector<CallSite> frames;
};

/// Where the user's text says what an instruction does.
mlir::Location getUserLocation(const llvm::Instruction *instruction,
                               const ParsedUnit &unit,
                               mlir::MLIRContext &context);

/// An error at the user's line for an instruction.
mlir::InFlightDiagnostic emitUserError(const llvm::Instruction *instruction,
                                       const ParsedUnit &unit,
                                       mlir::MLIRContext &context);

/// What a user calls a variable outside of the pipeline.
std::string describeVariable(llvm::StringRef mangledName);

} // namespace piko

#endif // PIKO_LIB_FRONTEND_SUPPORT_CALLCHAIN_H
