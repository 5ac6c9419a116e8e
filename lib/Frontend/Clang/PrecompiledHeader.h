// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// piko.h as Clang knows it when it has read it, for files that begin with it:
// most of the time that a file takes goes into that header and what it
// includes.

#ifndef PIKO_LIB_FRONTEND_PARSE_PRECOMPILEDHEADER_H
#define PIKO_LIB_FRONTEND_PARSE_PRECOMPILEDHEADER_H

#include "Piko/Frontend/Frontend.h"

#include "clang/Frontend/CompilerInvocation.h"
#include "llvm/ADT/STLFunctionalExtras.h"

namespace piko {

/// Makes the invocation that the header is for, with these options.
using InvocationMaker =
    llvm::function_ref<std::shared_ptr<clang::CompilerInvocation>(
        const FrontendOptions &,
        llvm::IntrusiveRefCntPtr<clang::DiagnosticsEngine>)>;

/// The precompiled header for a file, made where the store has none, or null:
/// without a store, where something comes before `#include <piko.h>` or is
/// defined that could change what it means, or where it has errors. It holds
/// no macros of the options but Piko's own, without PIKO_TUNED; Clang adds them
/// where it is used. With -fmodules-codegen among the flags, code is made of
/// its functions where it is built with an object, and not where it is used.
std::unique_ptr<llvm::MemoryBuffer>
getPrecompiledHeader(llvm::StringRef file, const FrontendOptions &options,
                     llvm::ArrayRef<const char *> flags,
                     const HeaderStore::Files &files, InvocationMaker invoke);

/// The options that the header for a file with `options` is made with.
FrontendOptions getHeaderOptions(const FrontendOptions &options);

/// What to put before a text for which there is such a header, and which
/// may have PIKO_TUNED.
std::string getTextAfterHeader(const FrontendOptions &options);

} // namespace piko

#endif // PIKO_LIB_FRONTEND_PARSE_PRECOMPILEDHEADER_H
