// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Ordinary C++ for this machine: how the reference executor is loaded.

#ifndef PIKO_FRONTEND_HOSTCOMPILER_H
#define PIKO_FRONTEND_HOSTCOMPILER_H

#include "Piko/Frontend/Frontend.h"

#include "llvm/IR/LLVMContext.h"
#include "llvm/IR/Module.h"

#include <memory>

namespace piko {

/// Compiles C++ text that begins with what `userFile` holds, without __PIKO__,
/// to LLVM IR for this machine; null after diagnostics in `context`'s engine.
/// With `optimize` the optimizer, which did not run yet, may work on it.
/// Overflow wraps and casts saturate, as the language says.
std::unique_ptr<llvm::Module>
compileForHost(llvm::StringRef text, llvm::StringRef userFile,
               const FrontendOptions &options, bool optimize,
               llvm::LLVMContext &llvmContext, mlir::MLIRContext &context);

} // namespace piko

#endif // PIKO_FRONTEND_HOSTCOMPILER_H
