// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Ordinary C++ for this machine: how the reference executor is loaded.

#ifndef PIKO_FRONTEND_HOSTCOMPILER_H
#define PIKO_FRONTEND_HOSTCOMPILER_H

#include "Piko/Frontend/Frontend.h"

#include "llvm/ADT/STLFunctionalExtras.h"
#include "llvm/IR/LLVMContext.h"
#include "llvm/IR/Module.h"

#include <memory>
#include <optional>

namespace piko {

struct HostCode {
  /// Null after diagnostics.
  std::unique_ptr<llvm::Module> module;
  /// Whether functions of piko.h are only declared: getHeaderCode's object
  /// defines them. All variables that both define are one.
  bool needsHeader = false;
};

/// The arguments of Clang for compileForHost: with these, and the text and the
/// files as they are, it makes the same.
std::vector<std::string> getHostArguments(const FrontendOptions &options,
                                          bool optimize);

/// Compiles C++ text that begins with what `userFile` holds, without __PIKO__,
/// to LLVM IR for this machine; diagnostics go to `context`'s engine. With
/// `optimize` the optimizer, which did not run yet, may work on it; without,
/// what the precompiled header has code for is left out, which is most of it.
/// Overflow wraps and casts saturate, as the language says.
HostCode compileForHost(llvm::StringRef text, llvm::StringRef userFile,
                        const FrontendOptions &options, bool optimize,
                        llvm::LLVMContext &llvmContext,
                        mlir::MLIRContext &context);

/// The object that code without optimization needs, made by `generate` where
/// the store of `options` has none for `target`; null after diagnostics.
std::unique_ptr<llvm::MemoryBuffer> getHeaderCode(
    const FrontendOptions &options, llvm::StringRef target,
    llvm::function_ref<std::optional<std::string>(llvm::Module &)> generate,
    mlir::MLIRContext &context);

} // namespace piko

#endif // PIKO_FRONTEND_HOSTCOMPILER_H
