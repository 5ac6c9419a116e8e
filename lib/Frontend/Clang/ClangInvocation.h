// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// How Clang is called on a pipeline's C++, whatever the code is for.

#ifndef PIKO_LIB_FRONTEND_PARSE_CLANGINVOCATION_H
#define PIKO_LIB_FRONTEND_PARSE_CLANGINVOCATION_H

#include "Piko/Frontend/Frontend.h"

#include "clang/Basic/Diagnostic.h"
#include "clang/Frontend/CompilerInvocation.h"

#include <memory>

namespace piko {

/// Clang's arguments, but for the file's name: for C++20 without contraction,
/// with the user's folders and macros, piko.h's folder and Clang's own headers,
/// and `flags`.
std::vector<std::string> getClangArguments(llvm::ArrayRef<const char *> flags,
                                           const FrontendOptions &options);

/// Whether the macros define PIKO_TUNED.
bool isTuned(const FrontendOptions &options);

/// A setting of a macro PIKO_TUNED.
struct TunedMacro {
  llvm::StringRef name, value;
};
/// What a macro's definition as PIKO_TUNED="name=value;..." sets, in its order;
/// empty of another macro.
llvm::SmallVector<TunedMacro> readTunedMacro(llvm::StringRef define);

/// The name of a macro that `-D` defines.
llvm::StringRef getMacroName(llvm::StringRef define);

/// The invocation with these arguments; null after an error.
std::shared_ptr<clang::CompilerInvocation> createClangInvocation(
    llvm::ArrayRef<const char *> flags, const FrontendOptions &options,
    llvm::StringRef mainName,
    llvm::IntrusiveRefCntPtr<clang::DiagnosticsEngine> diagnostics);

} // namespace piko

#endif // PIKO_LIB_FRONTEND_PARSE_CLANGINVOCATION_H
