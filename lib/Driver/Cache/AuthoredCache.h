// SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
//
// Authored pipelines on disk, as long as no file that they were read from
// changes: most of the time until a pipeline is compiled with other options
// goes into reading its C++ again.

#ifndef PIKO_LIB_DRIVER_AUTHOREDCACHE_H
#define PIKO_LIB_DRIVER_AUTHOREDCACHE_H

#include "Piko/Driver/Options.h"

#include "mlir/IR/BuiltinOps.h"
#include "mlir/IR/OwningOpRef.h"
#include "llvm/ADT/STLFunctionalExtras.h"
#include "llvm/Support/VirtualFileSystem.h"

namespace piko {

using AuthoredMaker = llvm::function_ref<mlir::OwningOpRef<mlir::ModuleOp>(
    llvm::IntrusiveRefCntPtr<llvm::vfs::FileSystem> files)>;

/// What `make` makes of a C++ file, or made for the same options and files.
/// What has diagnostics is not kept, because they are to be shown each time.
mlir::OwningOpRef<mlir::ModuleOp>
findAuthored(const CompileOptions &options, mlir::MLIRContext &context,
             llvm::IntrusiveRefCntPtr<llvm::vfs::FileSystem> files,
             AuthoredMaker make);

} // namespace piko

#endif // PIKO_LIB_DRIVER_AUTHOREDCACHE_H
